# Completion of takt for fish. The command itself knows what may follow.
# SPDX-License-Identifier: Apache-2.0

function __takt_complete
    set -l words (commandline -opc)
    set -l last (commandline -ct)
    for line in ($words[1] complete $words "$last" 2>/dev/null)
        if string match -q ':files*' -- $line
            set -l suffixes (string split ' ' -- $line)[2..-1]
            if test (count $suffixes) -eq 0
                __fish_complete_path "$last"
            else
                for suffix in $suffixes
                    __fish_complete_suffix .$suffix
                end
            end
        else
            echo $line
        end
    end
end
complete -c takt -f -a '(__takt_complete)'
