"""Benchmarks: run time against error, ratios within one run. May import everything."""

from symfric.bench.integrator import Benchmark as Benchmark
from symfric.bench.integrator import Row as Row
from symfric.bench.integrator import bench_integrator as bench_integrator
