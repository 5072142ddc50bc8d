# Who compiles the kernels for CUDA: nvcc makes a fatbin (machine code and PTX) for the devices it knows, Clang PTX 6.3
# for sm_53 and later, which every driver since CUDA 10.2 compiles. Either will do; none of CUDA's headers is needed.
#
# Sets BERTH_NVCC and BERTH_CUDA_CLANG, false where there is none (OFF goes without), and BERTH_CUDA_DEFAULT, ON where
# there is either.
find_program(BERTH_NVCC nvcc PATHS /usr/local/cuda/bin DOC "Compiles the CUDA kernels to a fatbin")

set(BERTH_CUDA_PTX_FLAGS -x cuda -std=c++14 -O3 -nocudainc -nocudalib --cuda-device-only --cuda-gpu-arch=sm_53
                         -Xclang -target-feature -Xclang +ptx63 -Wno-unknown-cuda-version)
# A Clang may be built without NVPTX, so each is tried.
function(berth_clang_makes_ptx out clang)
  set(probe ${CMAKE_BINARY_DIR}/CMakeFiles/berth_ptx_probe)
  file(WRITE ${probe}.cu "extern \"C\" __attribute__((global)) void probe(int* x) { *x = 1; }\n")
  execute_process(COMMAND ${clang} ${BERTH_CUDA_PTX_FLAGS} -S -o ${probe}.ptx ${probe}.cu
                  RESULT_VARIABLE status OUTPUT_QUIET ERROR_QUIET)
  set(${out} OFF PARENT_SCOPE)
  if(status EQUAL 0)
    file(STRINGS ${probe}.ptx version REGEX "^\\.version 6\\.3")
    if(version)
      set(${out} ON PARENT_SCOPE)
    endif()
  endif()
endfunction()
if(NOT DEFINED BERTH_CUDA_CLANG OR BERTH_CUDA_CLANG MATCHES "-NOTFOUND$")
  set(found BERTH_CUDA_CLANG-NOTFOUND)
  foreach(name IN ITEMS clang-14 clang clang-18 clang-17 clang-16 clang-15 clang-13 clang-12 clang-11)
    find_program(candidate ${name})
    mark_as_advanced(candidate)
    if(candidate)
      berth_clang_makes_ptx(works ${candidate})
      if(works)
        set(found ${candidate})
      endif()
    endif()
    unset(candidate CACHE)
    if(found)
      break()
    endif()
  endforeach()
  set(BERTH_CUDA_CLANG ${found} CACHE FILEPATH "Compiles the CUDA kernels to PTX" FORCE)
elseif(BERTH_CUDA_CLANG)
  berth_clang_makes_ptx(works ${BERTH_CUDA_CLANG})
  if(NOT works)
    message(FATAL_ERROR "BERTH_CUDA_CLANG=${BERTH_CUDA_CLANG} does not compile CUDA to PTX 6.3: name one that does, "
                        "or pass -DBERTH_CUDA_CLANG=OFF")
  endif()
endif()

if(BERTH_NVCC AND BERTH_CUDA_CLANG)
  message(STATUS "CUDA kernels: a fatbin by ${BERTH_NVCC}, PTX 6.3 by ${BERTH_CUDA_CLANG}")
elseif(BERTH_NVCC)
  message(STATUS "CUDA kernels: a fatbin by ${BERTH_NVCC}; Clang would add PTX 6.3 for older boards and drivers")
elseif(BERTH_CUDA_CLANG)
  message(STATUS "CUDA kernels: PTX 6.3 by ${BERTH_CUDA_CLANG}; nvcc would add machine code for newer devices")
else()
  message(STATUS "CUDA kernels: no compiler (apt install clang-14, or a CUDA toolkit); BERTH_WITH_CUDA is OFF by default")
endif()
set(BERTH_CUDA_DEFAULT OFF)
if(BERTH_NVCC OR BERTH_CUDA_CLANG)
  set(BERTH_CUDA_DEFAULT ON)
endif()

# berth_embed_cuda_images(OUT): sets OUT to a generated source that defines device_images() of cuda/module.hpp.
function(berth_embed_cuda_images out)
  set(kernels ${PROJECT_SOURCE_DIR}/backends/cuda/kernels.cu)
  file(GLOB texts CONFIGURE_DEPENDS ${BERTH_KERNELS_DIR}/*.h ${BERTH_KERNELS_DIR}/*.inl)
  list(APPEND texts ${BERTH_KERNELS_DIR}/prelude/cuda.h ${kernels})
  set(images "")
  set(files "")
  if(BERTH_NVCC)
    # nvcc 11 and later say what they know; 10.2 is the oldest there is a driver for.
    execute_process(COMMAND ${BERTH_NVCC} --list-gpu-code OUTPUT_VARIABLE known ERROR_QUIET RESULT_VARIABLE status)
    if(NOT status EQUAL 0)
      set(known "sm_53 sm_62 sm_72 sm_75")
    endif()
    set(targets "")
    set(lowest "")
    foreach(capability IN ITEMS 53 62 72 75 80 86 87 89 90)
      # Jetson boards (53, 62, 72, 87) run other drivers than the compilers that know no older board: theirs is the PTX.
      if(known MATCHES "sm_${capability}" AND NOT (capability EQUAL 87 AND NOT known MATCHES "sm_72"))
        list(APPEND targets -gencode arch=compute_${capability},code=sm_${capability})
        if(NOT lowest)
          set(lowest ${capability})
        endif()
      endif()
    endforeach()
    list(APPEND targets -gencode arch=compute_${lowest},code=compute_${lowest})
    set(fatbin ${CMAKE_CURRENT_BINARY_DIR}/kernels.fatbin)
    add_custom_command(
      OUTPUT ${fatbin}
      COMMAND ${BERTH_NVCC} -std=c++14 -fatbin -Xfatbin -compress-all -I${BERTH_KERNELS_DIR} ${targets} -o ${fatbin}
              ${kernels}
      DEPENDS ${texts} COMMENT "Compiling the CUDA kernels (nvcc)" VERBATIM)
    list(APPEND images "fatbin|${lowest}|${fatbin}")
    list(APPEND files ${fatbin})
  endif()
  if(BERTH_CUDA_CLANG)
    set(ptx ${CMAKE_CURRENT_BINARY_DIR}/kernels.ptx)
    add_custom_command(
      OUTPUT ${ptx}
      COMMAND ${BERTH_CUDA_CLANG} ${BERTH_CUDA_PTX_FLAGS} -S -I${BERTH_KERNELS_DIR} -o ${ptx} ${kernels}
      DEPENDS ${texts} COMMENT "Compiling the CUDA kernels (PTX 6.3)" VERBATIM)
    list(APPEND images "PTX 6.3|53|${ptx}")
    list(APPEND files ${ptx})
  endif()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/device_images.cpp)
  set(script ${PROJECT_SOURCE_DIR}/backends/cuda/embed_images.cmake)
  add_custom_command(
    OUTPUT ${source}
    COMMAND ${CMAKE_COMMAND} "-DIMAGES=${images}" -DOUT=${source} -P ${script}
    DEPENDS ${files} ${script} COMMENT "Embedding the CUDA kernels" VERBATIM)
  set(${out} ${source} PARENT_SCOPE)
endfunction()
