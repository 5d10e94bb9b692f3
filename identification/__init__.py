"""Identify friction from measured data: one `Fit` of any law, machine or model, and its verdict.

    data = Dataset.read("run*.csv")
    fit = Fit(InverseDynamics(), "stribeck", data).solve()
    print(fit)

Other types of residuals: `Points`, `Shooting`, `ClosedLoop`.
"""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from identification.cross import cross_validate as cross_validate
    from identification.data.dataset import Dataset as Dataset
    from identification.data.differentiate import MotionSignals as MotionSignals
    from identification.data.differentiate import differentiate as differentiate
    from identification.data.filters import Filter as Filter
    from identification.data.filters import central_difference as central_difference
    from identification.data.filters import lowpass as lowpass
    from identification.data.findings import Finding as Finding
    from identification.data.findings import Findings as Findings
    from identification.data.record import PositionLoop as PositionLoop
    from identification.data.record import Record as Record
    from identification.data.regression import LinearFit as LinearFit
    from identification.data.regression import linear_regression as linear_regression
    from identification.data.regression import plateaus as plateaus
    from identification.data.synthetic import synthetic_drive_data as synthetic_drive_data
    from identification.fit import Fit as Fit
    from identification.residuals.closed_loop import ClosedLoop as ClosedLoop
    from identification.residuals.closed_loop import Controller as Controller
    from identification.residuals.inverse import InverseDynamics as InverseDynamics
    from identification.residuals.points import Points as Points
    from identification.residuals.shooting import Shooting as Shooting
    from identification.result.fitted import Fitted as Fitted
    from identification.result.fitted import load_fit as load_fit
    from identification.result.parts import Estimate as Estimate
    from identification.robot.excitation import excitation as excitation
    from identification.robot.identify import identify_robot as identify_robot
    from identification.robot.identify import robot_information as robot_information
    from identification.robot.result import RobotFit as RobotFit
    from identification.robot.result import load_robot as load_robot
    from identification.select import select as select
    from identification.starts.experiments import break_away as break_away
    from identification.starts.experiments import six_steps as six_steps
    from identification.starts.maxwell_slip import fit_elements as fit_elements
    from identification.starts.measured import Measured as Measured
    from identification.starts.measured import hysteresis as hysteresis
    from identification.starts.start import start_values as start_values
    from identification.starts.stribeck import binned as binned
    from identification.starts.stribeck import fit_curve as fit_curve
    from identification.unknowns.spec import above as above
    from identification.unknowns.spec import linear as linear
    from identification.unknowns.spec import log as log
    from identification.unknowns.spec import tied as tied
    from identification.verdict.design import expected_errors as expected_errors
    from identification.verdict.design import informative as informative

load_lazily(__name__)
