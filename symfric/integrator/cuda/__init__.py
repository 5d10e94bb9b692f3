"""The adaptive attempt on a graphics processor, one member a thread: `backend="cuda"`.

Everything but the launches is what the other backends have: members start on the CPU, fail with the
same sentences, stop and go on where algebraic unknowns have to be searched for, and go chunk by
chunk to memory or to a folder. The own emitter writes attempt, signals and the jump of algebraic
unknowns in C (`step.pieces`); `members.h` goes with them from input interval to input interval. A
thread whose member is done takes the next one, so that the threads of a warp stay together until no
member is left; a launch ends after a number of attempts that takes a quarter of a second, and the
members that are under way go on in the next one.

What is tested where. The text of the kernel is C and CUDA C++ alike. Compiled for a processor it
gives, through the same driver, the bits of the virtual machine for every scene without modes
(`tests/symfric/integrator/cuda`); NVRTC compiles it without a graphics processor (`device`), which
shows what it refuses, and how many registers a thread takes; the calls of CuPy are checked by a
module in its place. On a device nothing is contracted to fused multiply-adds, so that only the last
digits of exp, sin, pow and the like are others than those tested. It has not run on a graphics
processor yet: none was at hand. Where there is one, `test_gpu.py` compares with the CPU, and
`symfric bench ensemble` measures members a second.

Limits: models with events are refused. Large mechanisms spill: a slider-crank (4100 operations)
takes all 255 registers, a six-joint arm (27000) writes kilobytes of memory in every attempt and
takes NVRTC a minute. Single precision (`real="float"`) follows double at rtol 1e-4 with as many
attempts and as small errors; at 1e-5 errors stay at up to 4e-5 of the largest magnitudes, with up
to twice as many attempts; below it is refused, where rounding is taken for error and steps shrink
to nothing. Times stay double, and differences of large numbers lose digits.
"""
