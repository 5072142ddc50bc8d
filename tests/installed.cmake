# Installs what the build made into a folder of its own and uses it as others would: by find_package, by pkg-config, and
# moved elsewhere. The commands are those of docs/packages.md.
#   cmake -DBUILD=… -DROOT=… -DSCRATCH=… -DPHOTO=… -DC_COMPILER=… -DCXX_COMPILER=… -P installed.cmake

# run(OUT COMMAND...): sets OUT to what it prints.
function(run out)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${status}\n${text}")
  endif()
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${SCRATCH})
foreach(part IN ITEMS runtime dev)
  run(ignored ${CMAKE_COMMAND} --install ${BUILD} --prefix ${SCRATCH}/first --component ${part})
endforeach()
# Nothing may remember where it was put.
file(RENAME ${SCRATCH}/first ${SCRATCH}/moved)

run(ignored ${CMAKE_COMMAND} -S ${ROOT}/examples/consumer -B ${SCRATCH}/consumer -G Ninja
    -DCMAKE_PREFIX_PATH=${SCRATCH}/moved -DCMAKE_C_COMPILER=${C_COMPILER} -DCMAKE_CXX_COMPILER=${CXX_COMPILER})
run(ignored ${CMAKE_COMMAND} --build ${SCRATCH}/consumer)
run(text ${SCRATCH}/consumer/print_pose ${PHOTO})
if(NOT text MATCHES "^tag36h11 7 at -?[0-9.]+ -?[0-9.]+ [0-9.]+ m\n$")
  message(FATAL_ERROR "the C++ consumer printed: ${text}")
endif()

# The C program reads PGM; there is no marker in this one.
string(REPEAT "gray" 768 pixels)
file(WRITE ${SCRATCH}/gray.pgm "P5 64 48 255\n${pixels}")
set(ENV{PKG_CONFIG_PATH} ${SCRATCH}/moved/lib/pkgconfig)
run(flags pkg-config --cflags --libs berth)
separate_arguments(flags UNIX_COMMAND "${flags}")
run(ignored ${C_COMPILER} -std=c99 ${ROOT}/examples/print_pose.c ${flags} -o ${SCRATCH}/print_pose_c)
set(ENV{LD_LIBRARY_PATH} ${SCRATCH}/moved/lib)
foreach(program IN ITEMS ${SCRATCH}/consumer/print_pose_c ${SCRATCH}/print_pose_c)
  run(text ${program} ${SCRATCH}/gray.pgm)
  if(NOT text STREQUAL "")
    message(FATAL_ERROR "${program} printed: ${text}")
  endif()
endforeach()

run(flags pkg-config --cflags --libs berth-cpp)
separate_arguments(flags UNIX_COMMAND "${flags}")
file(WRITE ${SCRATCH}/mine.cpp "#include \"berth/detector.hpp\"\n"
                               "int main() { return berth::open_backend(\"simd\")->name() == nullptr; }\n")
run(ignored ${CXX_COMPILER} -std=c++17 ${SCRATCH}/mine.cpp ${flags} -o ${SCRATCH}/mine)
run(ignored ${SCRATCH}/mine)
file(REMOVE_RECURSE ${SCRATCH})
