"""CMake files of a kit: one for all kits in a folder, and one for each block."""

from collections.abc import Sequence

from symfric.codegen.blocks.block import Block
from symfric.codegen.writing.layout import prefix
from symfric.emitter.c99 import Real

EVERY = """\
# All generated blocks in this folder: libraries, unit tests (ctest), shared libraries for Python.
#   cmake -S . -B build && cmake --build build && ctest --test-dir build
# In a project of your own: add_subdirectory(this_folder) and target_link_libraries(app NAME).
cmake_minimum_required(VERSION 3.13)
project(symfric_blocks LANGUAGES C)
enable_testing()
file(GLOB blocks CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*_block.cmake")
foreach(block IN LISTS blocks)
    include("${block}")
endforeach()
"""
"""Text of CMakeLists.txt, the same for every block, so that kits may share a folder."""

ONE = """\
# The block {name}: library {name}, shared library {name}_shared, {tests}.
# A core without an operating system gets the library alone; with CMAKE_CROSSCOMPILING_EMULATOR
# the unit test, too.
add_library({name} STATIC {sources})
set(libraries {name})
get_property(can_share GLOBAL PROPERTY TARGET_SUPPORTS_SHARED_LIBS)
if(can_share)
    add_library({name}_shared SHARED {sources})
    set_target_properties({name}_shared PROPERTIES WINDOWS_EXPORT_ALL_SYMBOLS ON)
    list(APPEND libraries {name}_shared)
endif()
foreach(library IN LISTS libraries)
    target_include_directories(${{library}} PUBLIC "${{CMAKE_CURRENT_LIST_DIR}}")
    set_target_properties(${{library}} PROPERTIES C_STANDARD 99 C_EXTENSIONS OFF)
    if(CMAKE_C_COMPILER_ID MATCHES "GNU|Clang")
        # Without fused multiply-add the results are those of CasADi to the bit, in double.
        target_compile_options(${{library}} PRIVATE -ffp-contract=off)
    endif()
    if(UNIX OR (NOT WIN32 AND CMAKE_C_COMPILER_ID MATCHES "^(GNU|Clang)$"))
        target_link_libraries(${{library}} PUBLIC m)
    endif()
endforeach()
if(NOT CMAKE_CROSSCOMPILING OR CMAKE_CROSSCOMPILING_EMULATOR)
    foreach(test {each})
        add_executable(${{test}} "${{CMAKE_CURRENT_LIST_DIR}}/${{test}}.c")
        set_target_properties(${{test}} PROPERTIES C_STANDARD 99 C_EXTENSIONS OFF)
        target_link_libraries(${{test}} PRIVATE {name})
        add_test(NAME ${{test}} COMMAND ${{test}})
    endforeach()
endif()
"""


def of_block(block: Block, reals: Sequence[Real]) -> str:
    """Text of NAME_block.cmake: a static and a shared library, unit tests, where they can be."""
    stems = [prefix(block, real) for real in reals]
    tests = [f"{stem}_test" for stem in stems]
    return ONE.format(
        name=block.name,
        sources=" ".join(f'"${{CMAKE_CURRENT_LIST_DIR}}/{stem}.c"' for stem in stems),
        tests=f"unit test{'s' * (len(tests) > 1)} {', '.join(tests)}",
        each=" ".join(tests),
    )
