/* FMI 3.0: communication steps. */

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean on,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference required[],
    size_t n_required, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update)
{
    Instance *unit = unit_of(made(name, token, on, environment, log));
    if (unit) unit->m.returns = early_return;
    return unit;
}

/* Return fmi3Discard for an invalid communication step, which has no effect, and an error if steps
   fail. A terminal event sets `early` and `terminate`; other events set `early` if the importer
   allowed it, with the values after the event. */
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean no_return,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                      fmi3Float64 *reached)
{
    Instance *unit = unit_of(c);
    Outcome found;
    if (!allowed(unit, "fmi3DoStep", RUNNING, ENDED)) return fmi3Error;
    found = advance(unit, time, size);
    *event = fmi3False;
    *terminate = found == OVER;
    *early = found == OVER || found == EARLY;
    *reached = unit->m.t;
    switch (found) {
    case DONE:
    case EARLY:
    case OVER:
        return fmi3OK;
    case REFUSED:
        return refused(unit);
    case FAILED:
    default:
        return failed(unit);
    }
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                                    const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t n_values)
{
    return n ? fmi3Error : fmi3OK;
}
