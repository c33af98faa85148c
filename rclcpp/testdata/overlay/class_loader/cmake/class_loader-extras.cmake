# SPDX-License-Identifier: Apache-2.0
macro(class_loader_export name)
  set(exported_classes "${exported_classes}${name}\n")
endmacro()
ament_register_extension(ament_package class_loader class_loader-hook.cmake)
