"""Laws with states whose options lead to other expressions than the defaults."""

from symfric import Law
from symfric.laws import GMS, ElastoPlastic, MaxwellSlip

DYNAMIC: dict[str, Law] = {
    "elasto_plastic, viscous": ElastoPlastic(sigma_2=0.4),
    "maxwell_slip, n 2": MaxwellSlip(n=2.0),
    "maxwell_slip, event": MaxwellSlip(form="event"),
    "gms, event, viscous": GMS(sigma_2=0.4, form="event"),
}
