#include <stdint.h>

extern uint32_t _data_source, _data, _data_end, _bss, _bss_end, _stack;
int main(void);
void say(const char *text);
void word(uint32_t value);
void Reset_Handler(void);

static void host(int operation, const void *argument)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

void say(const char *text) { host(0x04, text); }

void word(uint32_t value)
{
    char text[10];
    int i;
    for (i = 0; i < 8; i++) {
        const uint32_t digit = (value >> (28 - 4 * i)) & 15u;
        text[i] = (char)(digit < 10u ? '0' + digit : 'a' + digit - 10u);
    }
    text[8] = '\n';
    text[9] = 0;
    say(text);
}

static void leave(uint32_t status)
{
    const uint32_t arguments[2] = {0x20026u, status};
    host(0x20, arguments);
    for (;;) { }
}

void Reset_Handler(void)
{
    uint32_t *from = &_data_source, *to = &_data;
#if defined(__ARM_FP)
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* enable the FPU, which is off after a reset */
    __asm__ volatile("dsb\n isb");
#endif
    while (to < &_data_end) { *to++ = *from++; }
    for (to = &_bss; to < &_bss_end; ) { *to++ = 0u; }
    leave((uint32_t)main());
}

static void fault(void) { say("FAULT\n"); leave(99u); }

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    &_stack, Reset_Handler, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, fault,
    fault };
