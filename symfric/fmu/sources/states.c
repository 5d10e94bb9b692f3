/* States that an importer keeps: the whole memory of an instance, and as bytes. */

static int of_this_model(const void *bytes)
{
    unsigned long long kind;
    memcpy(&kind, bytes, sizeof kind);
    return kind == MODEL_KIND;
}

/* Put a state into a place, a new one where there is none yet; 0 where there is no memory. */
static int kept(const void *state, void **place)
{
    if (!*place) *place = malloc(sizeof(Memory));
    if (*place) memcpy(*place, state, sizeof(Memory));
    return *place != NULL;
}

/* The state in an instance that goes on from it; 0 where it is of another model. */
static int put_back(Instance *unit, const void *state)
{
    if (!of_this_model(state)) return 0;
    memcpy(&unit->m, state, sizeof(Memory));
    return 1;
}

/* The state that bytes hold; 0, and why, where they hold none. */
static int unpacked(Instance *unit, const void *bytes, size_t size, void **place)
{
    if (size != sizeof(Memory) || !of_this_model(bytes)) {
        say(unit, "deserialise: expected the bytes of a state of this model");
        return 0;
    }
    say(unit, "deserialise: expected memory for a state, got none");
    return kept(bytes, place);
}
