# SPDX-License-Identifier: Apache-2.0
# The module that comes with python_cmake_module: packages ask for it beside their tests in Python.
find_program(PYTHON_EXECUTABLE python3)
set(PythonExtra_FOUND ON)
