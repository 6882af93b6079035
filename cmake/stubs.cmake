# Writes FOLDER/_native.pyi, the types of the module in FOLDER, with the program STUBGEN (pybind11-stubgen).
cmake_minimum_required(VERSION 3.25)
# pip finds the packages of an isolated build by the former value.
cmake_path(CONVERT "${FOLDER};$ENV{PYTHONPATH}" TO_NATIVE_PATH_LIST paths)
set(ENV{PYTHONPATH} "${paths}")
execute_process(COMMAND ${STUBGEN} --exit-code --numpy-array-remove-parameters --output-dir ${FOLDER} _native
                COMMAND_ERROR_IS_FATAL ANY)
# A std::array of N numbers accepts any sequence.
file(READ ${FOLDER}/_native.pyi types)
string(REGEX REPLACE "typing\\.Annotated\\[list\\[float\\], pybind11_stubgen\\.typing_ext\\.FixedSize\\([0-9]\\)\\]"
                     "typing.Sequence[float]" types "${types}")
string(REPLACE "import pybind11_stubgen.typing_ext\n" "" types "${types}")
file(WRITE ${FOLDER}/_native.pyi "${types}")
