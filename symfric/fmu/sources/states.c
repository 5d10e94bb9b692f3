/* States that an importer stores: the memory of an instance, also as bytes. */

static int of_this_model(const void *bytes)
{
    unsigned long long kind;
    memcpy(&kind, bytes, sizeof kind);
    return kind == MODEL_KIND;
}

/* Copy a state to a place, allocated if it is NULL; return 0 without memory. */
static int kept(const void *state, void **place)
{
    if (!*place) *place = malloc(sizeof(Memory));
    if (*place) memcpy(*place, state, sizeof(Memory));
    return *place != NULL;
}

/* Restore a state; return 0 if it belongs to another model. */
static int put_back(Instance *unit, const void *state)
{
    if (!of_this_model(state)) return 0;
    memcpy(&unit->m, state, sizeof(Memory));
    return 1;
}

/* Read a state from bytes; return 0 and set a message on failure. */
static int unpacked(Instance *unit, const void *bytes, size_t size, void **place)
{
    if (size != sizeof(Memory) || !of_this_model(bytes)) {
        say(unit, "deserialise: expected the bytes of a state of this model");
        return 0;
    }
    say(unit, "deserialise: expected memory for a state, got none");
    return kept(bytes, place);
}
