/* FMI 3.0: calls of co-simulation, which model exchange does not have. */

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String
    resources, fmi3Boolean visible, fmi3Boolean on, fmi3Boolean event_mode, fmi3Boolean
    early_return, const fmi3ValueReference required[], size_t n_required, fmi3InstanceEnvironment
    environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    UNUSED(name);
    UNUSED(token);
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(on);
    UNUSED(event_mode);
    UNUSED(early_return);
    UNUSED(required);
    UNUSED(n_required);
    UNUSED(environment);
    UNUSED(log);
    UNUSED(update);
    return NULL;
}

fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    UNUSED(c);
    return fmi3Error;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const fmi3Int32 orders[], fmi3Float64 values[], size_t n_values)
{
    UNUSED(c);
    UNUSED(references);
    UNUSED(n);
    UNUSED(orders);
    UNUSED(values);
    UNUSED(n_values);
    return fmi3Error;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean no_return,
    fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached)
{
    UNUSED(c);
    UNUSED(time);
    UNUSED(size);
    UNUSED(no_return);
    UNUSED(event);
    UNUSED(terminate);
    UNUSED(early);
    UNUSED(reached);
    return fmi3Error;
}
