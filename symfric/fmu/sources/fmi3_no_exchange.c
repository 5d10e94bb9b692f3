/* FMI 3.0: functions of model exchange and event mode, without support in co-simulation. */

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean on,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    return NULL;
}

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    return fmi3Error;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c)
{
    return fmi3Error;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
    fmi3Boolean *nominals_changed, fmi3Boolean *values_changed, fmi3Boolean *has_next, fmi3Float64
    *next)
{
    return fmi3Error;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    return fmi3Error;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_return, fmi3Boolean
    *event_mode, fmi3Boolean *terminate)
{
    return fmi3Error;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    return fmi3Error;
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n)
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 derivatives[], size_t
    n)
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicators[], size_t n)
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n)
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t n)
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    return fmi3Error;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    return fmi3Error;
}

fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    return fmi3Error;
}
