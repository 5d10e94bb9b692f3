/* FMI 3.0: functions of co-simulation, without support in model exchange. */

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String
    resources, fmi3Boolean visible, fmi3Boolean on, fmi3Boolean event_mode, fmi3Boolean
    early_return, const fmi3ValueReference required[], size_t n_required, fmi3InstanceEnvironment
    environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    return NULL;
}

fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    return fmi3Error;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const fmi3Int32 orders[], fmi3Float64 values[], size_t n_values)
{
    return fmi3Error;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean no_return,
    fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached)
{
    return fmi3Error;
}
