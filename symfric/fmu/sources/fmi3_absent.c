/* FMI 3.0: functions without support in any unit: other types of variables, clocks, configurations,
   adjoint derivatives, variable dependencies. */

#define NONE_OF(type)                                                                             \
    fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference references[], size_t n,     \
                             fmi3##type values[], size_t n_values)                                \
    {                                                                                             \
        return n ? fmi3Error : fmi3OK;                                                            \
    }                                                                                             \
    fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference references[], size_t n,     \
                             const fmi3##type values[], size_t n_values)                          \
    {                                                                                             \
        return n ? fmi3Error : fmi3OK;                                                            \
    }

NONE_OF(Float32)
NONE_OF(Int8)
NONE_OF(UInt8)
NONE_OF(Int16)
NONE_OF(UInt16)
NONE_OF(Int32)
NONE_OF(UInt32)
NONE_OF(Int64)
NONE_OF(UInt64)
NONE_OF(Boolean)
NONE_OF(String)

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference references[], size_t n, size_t
    sizes[], fmi3Binary values[], size_t n_values)
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference references[], size_t n,
    fmi3Clock values[])
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference references[], size_t n, const
    size_t sizes[], const fmi3Binary values[], size_t n_values)
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference references[], size_t n, const
    fmi3Clock values[])
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference reference,
    size_t *n)
{
    return fmi3Error;
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t
    elements[], fmi3ValueReference independents[], size_t of_independents[], fmi3DependencyKind
    kinds[], size_t n)
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t
    n_unknowns, const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seeds[],
    size_t n_seeds, fmi3Float64 values[], size_t n_values)
{
    return fmi3Error;
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c)
{
    return fmi3Error;
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c)
{
    return fmi3Error;
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference references[], size_t n,
    fmi3Float64 shifts[])
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference references[], size_t n,
    fmi3UInt64 counters[], fmi3UInt64 resolutions[])
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, const fmi3Float64 intervals[])
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference references[], size_t n,
    const fmi3Float64 shifts[])
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference references[], size_t n,
    const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    return n ? fmi3Error : fmi3OK;
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64
    time)
{
    return fmi3Error;
}
