"""Adaptive attempt on a graphics processor, one member per thread: `backend="cuda"`.

Everything except the launches is shared with the other backends: members start on the CPU, fail
with the same messages, stop and continue where algebraic unknowns need a full search, and are
stored chunk by chunk in memory or in a folder. symfric's own emitter writes the attempt, the
signals and the update of algebraic unknowns in C (`methods.pieces`); `members.h` advances over the
input intervals. A thread that has finished a member takes the next one, so the threads of a warp
stay together until no member is left. A launch ends after a number of attempts that takes a quarter
of a second, and unfinished members continue in the next launch.

Tests: the text of the kernel is valid C and CUDA C++. Compiled for a CPU and called through the
same driver, it computes the same bits as `backend="compiled"` for every scene without modes, if
both call the same math library (`tests/symfric/integrator/cuda`). NVRTC compiles it without a
graphics processor (`device`), which shows errors and the number of registers per thread; the calls
of CuPy are checked with a fake module. On a device no operations are contracted to fused
multiply-adds, so only the last digits of exp, sin, pow and similar functions differ from the tested
ones. With a graphics processor, `test_gpu.py` compares with the CPU, and `symfric bench ensemble`
measures members per second; both ran on an NVIDIA H200.

Limits: models with events are refused. Large mechanisms spill registers: a slider-crank (4100
operations) takes all 255 registers; a six-joint arm (27000 operations) writes kilobytes of memory
in every attempt, and NVRTC compiles it for a minute. Single precision (`real="float"`) matches
double precision at rtol 1e-4 with as many attempts and as small errors; at 1e-5, errors remain up
to 4e-5 of the largest magnitudes, with up to twice as many attempts. Smaller tolerances are
refused, because error control would mistake rounding for error and reduce the step without end.
Times remain double; differences of large numbers lose digits.
"""
