# Looks for what the Python module needs: Python's headers and nanobind (from PyPI), in the virtual environment that
# ./bootstrap makes, in $VIRTUAL_ENV or in the system. Sets BERTH_PYTHON_FOUND.
set(BERTH_PYTHON_FOUND FALSE)
set(bootstrap_python ${CMAKE_CURRENT_LIST_DIR}/../build/python/bin/python)
if(NOT DEFINED Python_EXECUTABLE AND EXISTS ${bootstrap_python})
  set(Python_EXECUTABLE ${bootstrap_python} CACHE FILEPATH "Python that the module is built for")
endif()
if(NOT BERTH_SANITIZE AND NOT CMAKE_CROSSCOMPILING)
  find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module)
  if(Python_FOUND)
    execute_process(COMMAND ${Python_EXECUTABLE} -m nanobind --cmake_dir OUTPUT_VARIABLE nanobind_ROOT ERROR_QUIET
                    OUTPUT_STRIP_TRAILING_WHITESPACE)
    find_package(nanobind 3 CONFIG QUIET)
    set(BERTH_PYTHON_FOUND ${nanobind_FOUND})
  endif()
endif()
