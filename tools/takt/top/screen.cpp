// SPDX-License-Identifier: Apache-2.0
#include "top/screen.hpp"

#include <clocale>
#include <cstdlib>
#include <string_view>

#include <curses.h>
#include <langinfo.h>
#include <termios.h>
#include <unistd.h>

#include "takt/base/error.hpp"

#include "run/end_signals.hpp"

namespace takt::tools::top {
namespace {

chtype attribute_of(Line::Kind kind) {
  switch (kind) {
    case Line::Kind::plain:
    case Line::Kind::help:
      return A_NORMAL;
    case Line::Kind::title:
    case Line::Kind::bad:
      return A_BOLD;
    case Line::Kind::header:
      return A_UNDERLINE;
    case Line::Kind::selected:
      return A_REVERSE;
    case Line::Kind::old:
      return A_DIM;
  }
  return A_NORMAL;
}

int key_of(int code) {
  switch (code) {
    case KEY_UP:
      return kUp;
    case KEY_DOWN:
      return kDown;
    case KEY_PPAGE:
      return kPageUp;
    case KEY_NPAGE:
      return kPageDown;
    case KEY_HOME:
      return kHome;
    case KEY_END:
      return kEnd;
    case KEY_LEFT:
      return kLeft;
    case KEY_RIGHT:
      return kRight;
    case KEY_BACKSPACE:
    case '\b':
    case 127:
      return kErase;
    case KEY_ENTER:
      return '\n';
    case 27:
      return kEscape;
    default:
      return code;
  }
}

termios before{};  // what the terminal was like

// What endwin() does, for an end in the middle of everything.
void leave_terminal() {
  static constexpr char kLeave[] = "\033[?1049l\033[?25h\033[0m\r\n";
  [[maybe_unused]] const ssize_t written = write(STDOUT_FILENO, kLeave, sizeof kLeave - 1);
  tcsetattr(STDIN_FILENO, TCSANOW, &before);
}

}  // namespace

// newterm, not initscr, which ends the process where it knows no terminal.
Screen::Screen() {
  std::setlocale(LC_CTYPE, "");
  has_blocks_ = std::string_view(nl_langinfo(CODESET)) == "UTF-8";
  tcgetattr(STDIN_FILENO, &before);
  EndSignals::set_last_act(&leave_terminal);
  set_escdelay(50);  // a sequence of the terminal, or Esc itself
  if (newterm(nullptr, stdout, stdin) == nullptr) {
    const char* const term = std::getenv("TERM");
    throw Error(std::string("the terminal '") + (term != nullptr ? term : "") + "' is not known",
                "set TERM, or use --json");
  }
  cbreak();
  noecho();
  nonl();
  keypad(stdscr, TRUE);
  nodelay(stdscr, TRUE);
  curs_set(0);
}

Screen::~Screen() {
  endwin();
  EndSignals::set_last_act(nullptr);
}

void Screen::draw(View& view) {
  const int height = getmaxy(stdscr), width = getmaxx(stdscr);
  erase();
  int y = 0;
  for (const Line& line :
       view.lines(static_cast<std::size_t>(width), static_cast<std::size_t>(height))) {
    attrset(static_cast<int>(attribute_of(line.kind)));
    mvaddstr(y++, 0, line.text.c_str());
    if (line.kind == Line::Kind::selected) {
      for (int x = getcurx(stdscr); x < width && getcury(stdscr) == y - 1; ++x) addch(' ');
    }
  }
  attrset(A_NORMAL);
  refresh();
}

std::optional<int> Screen::key() {
  const int code = getch();
  if (code == ERR) return {};
  return key_of(code);
}

}  // namespace takt::tools::top
