# Python for tests whose judges are Python packages: ./bootstrap ci-deps puts them where this looks.
set(BERTH_TEST_PYTHON ${PROJECT_SOURCE_DIR}/build/python/bin/python CACHE FILEPATH
    "Python that has the packages tests compare with")

# berth_python_test_modules(RESULT MODULE...): sets RESULT to whether all can be imported; says so where one cannot.
# Sanitizers see nothing of them: false there.
function(berth_python_test_modules result)
  set(${result} OFF PARENT_SCOPE)
  if(BERTH_SANITIZE)
    return()
  endif()
  foreach(module IN LISTS ARGN)
    execute_process(COMMAND ${BERTH_TEST_PYTHON} -c "import ${module}" RESULT_VARIABLE failed OUTPUT_QUIET ERROR_QUIET)
    if(NOT failed STREQUAL 0)
      message(STATUS "Tests that need Python's ${module} are left out: ./bootstrap ci-deps installs it")
      return()
    endif()
  endforeach()
  set(${result} ON PARENT_SCOPE)
endfunction()
