"""Benchmarks of run time and error, as ratios of one run. May import every other package."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.bench.calls import CallBenchmark as CallBenchmark
    from symfric.bench.calls import bench_calls as bench_calls
    from symfric.bench.codegen import CodegenBenchmark as CodegenBenchmark
    from symfric.bench.codegen import EmbeddedBenchmark as EmbeddedBenchmark
    from symfric.bench.codegen import bench_codegen as bench_codegen
    from symfric.bench.codegen import bench_embedded as bench_embedded
    from symfric.bench.ensemble import EnsembleRow as EnsembleRow
    from symfric.bench.ensemble import LaneBenchmark as LaneBenchmark
    from symfric.bench.ensemble import bench_ensemble as bench_ensemble
    from symfric.bench.identification import IdentificationBenchmark as IdentificationBenchmark
    from symfric.bench.identification import bench_identification as bench_identification
    from symfric.bench.integrator import Benchmark as Benchmark
    from symfric.bench.integrator import Row as Row
    from symfric.bench.integrator import SensitivityRow as SensitivityRow
    from symfric.bench.integrator import bench_integrator as bench_integrator
    from symfric.bench.interop import InteropBenchmark as InteropBenchmark
    from symfric.bench.interop import bench_interop as bench_interop
    from symfric.bench.ivp import IvpBenchmark as IvpBenchmark
    from symfric.bench.ivp import bench_ivp as bench_ivp
    from symfric.bench.jitter import bench_jitter as bench_jitter
    from symfric.bench.jitter import jitter as jitter
    from symfric.bench.multibody import MultibodyBenchmark as MultibodyBenchmark
    from symfric.bench.multibody import bench_multibody as bench_multibody
    from symfric.bench.ocp import OcpBenchmark as OcpBenchmark
    from symfric.bench.ocp import bench_ocp as bench_ocp
    from symfric.bench.regularisation import RegularisationBenchmark as RegularisationBenchmark
    from symfric.bench.regularisation import bench_regularisation as bench_regularisation

load_lazily(__name__)
