#include <stdint.h>

void say(const char *text);
void word(uint32_t value);
int @{name}_test(void);

int main(void)
{
    say("wrong\n"); word((uint32_t)@{name}_test());
    say("end\n");
    return 0;
}
