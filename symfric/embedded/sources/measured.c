#include <stdint.h>
#include <string.h>
@include
#define STEPS @steps
#define PAINT 0xDEADBEEFu
#define DEPTH 16384 /* number of words of the stack that are examined */
#define EXAMINED 4000 /* largest number of steps that use the examined stack */
#define IDLE 400
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)

typedef @real real_t;
void say(const char *text);
void word(uint32_t value);
extern char _block, _block_end, _library, _library_end;

static const real_t U[STEPS][@inputs] = {
@values
};
static real_t Y[STEPS][@columns];
@declarations

static __attribute__((noinline)) void start(void) { @start }
static __attribute__((noinline)) void one(int k) { @step }
static __attribute__((noinline)) void nothing(int k) { (void)k; __asm__ volatile(""); }
static void keep(int k) { @keep }

/* An instruction takes 3.2 ticks; random delays before each step remove the error in the mean. */
static __attribute__((noinline)) void wait(void)
{
    static uint32_t dice = 1u;
    uint32_t count;
    dice = dice * 1664525u + 1013904223u;
    for (count = dice >> 26; count > 0u; count--) { __asm__ volatile("nop"); }
}

static __attribute__((noinline)) uint32_t ticks(void (*what)(int), int k)
{
    const uint32_t before = SYST_CVR;
    what(k);
    return (before - SYST_CVR) & 0xFFFFFFu; /* the timer counts down in 24 bits */
}

static __attribute__((noinline)) uint32_t stack(void)
{
    volatile uint32_t *p;
    uint32_t *top;
    int k;
    __asm__ volatile("mov %0, sp" : "=r"(top));
    for (p = top - DEPTH; p < top - 8; p++) { *p = PAINT; }
    for (k = 0; k < STEPS && k < EXAMINED; k++) { one(k); }
    for (p = top - DEPTH; p < top - 8 && *p == PAINT; p++) { }
    return (uint32_t)((uintptr_t)top - (uintptr_t)p);
}

int main(void)
{
    const uint32_t *rows = (const uint32_t *)Y;
    static uint32_t cost[STEPS], idle[IDLE];
    uint32_t i;
    int k;
    start();
    say("stack\n"); word(stack());
    say("text\n"); word((uint32_t)(&_block_end - &_block));
    say("library\n"); word((uint32_t)(&_library_end - &_library));
    say("data\n"); word((uint32_t)(@data));
    start();
    SYST_RVR = 0xFFFFFFu; SYST_CVR = 0u; SYST_CSR = 5u;
    for (k = 0; k < IDLE; k++) { wait(); idle[k] = ticks(nothing, k); }
    for (k = 0; k < STEPS; k++) { wait(); cost[k] = ticks(one, k); keep(k); }
    say("idle\n");
    for (k = 0; k < IDLE; k++) { word(idle[k]); }
    say("ticks\n");
    for (k = 0; k < STEPS; k++) { word(cost[k]); }
    say("rows\n");
    for (i = 0u; i < sizeof Y / 4u; i++) { word(rows[i]); }
    say("end\n");
    return 0;
}
