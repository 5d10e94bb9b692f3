"""What stands round the code that is measured: start-up code, linker script, main program.

The main program calls a block step by step and says by semihosting what each step cost and gave:
numbers as words of eight hexadecimal digits, one a line, behind a line with their name. Steps are
timed by SysTick, which under QEMU's -icount counts instructions and nothing else.
"""

from string import Template

STARTUP = """\
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
    text[8] = '\\n';
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
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* the FPU, off after a reset */
    __asm__ volatile("dsb\\n isb");
#endif
    while (to < &_data_end) { *to++ = *from++; }
    for (to = &_bss; to < &_bss_end; ) { *to++ = 0u; }
    leave((uint32_t)main());
}

static void fault(void) { say("FAULT\\n"); leave(99u); }

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    &_stack, Reset_Handler, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, fault,
    fault };
"""

LINKER = """\
MEMORY
{
    FLASH (rx) : ORIGIN = 0x00000000, LENGTH = 4M
    RAM (rwx) : ORIGIN = 0x20000000, LENGTH = 4M
}
ENTRY(Reset_Handler)
SECTIONS
{
    .vectors : { KEEP(*(.vectors)) } > FLASH
    .block : { _block = .; *block.o(.text* .rodata*) _block_end = .; } > FLASH
    .library : { _library = .; *.a:*(.text* .rodata*) _library_end = .; } > FLASH
    .text : { *(.text*) *(.rodata*) . = ALIGN(8); } > FLASH
    .ARM.exidx : { *(.ARM.exidx*) } > FLASH
    _data_source = LOADADDR(.data);
    .data : { _data = .; *(.data*) . = ALIGN(8); _data_end = .; } > RAM AT> FLASH
    .bss (NOLOAD) : { _bss = .; *(.bss*) *(COMMON) . = ALIGN(8); _bss_end = .; } > RAM
    _stack = ORIGIN(RAM) + LENGTH(RAM);
}
"""

MAIN = Template("""\
#include <stdint.h>
#include <string.h>
$include
#define STEPS $steps
#define PAINT 0xDEADBEEFu
#define DEPTH 16384 /* words of the stack that are watched */
#define IDLE 400
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)

typedef $real real_t;
void say(const char *text);
void word(uint32_t value);
extern char _block, _block_end, _library, _library_end;

static const real_t U[STEPS][$inputs] = {
$values
};
static real_t Y[STEPS][$columns];
$declarations

static __attribute__((noinline)) void start(void) { $start }
static __attribute__((noinline)) void one(int k) { $step }
static __attribute__((noinline)) void nothing(int k) { (void)k; __asm__ volatile(""); }
static void keep(int k) { $keep }

/* An instruction takes 3.2 ticks: a step that begins anywhere in one is known in the mean. */
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
    return (before - SYST_CVR) & 0xFFFFFFu; /* it counts down, in 24 bits */
}

static __attribute__((noinline)) uint32_t stack(void)
{
    volatile uint32_t *p;
    uint32_t *top;
    int k;
    __asm__ volatile("mov %0, sp" : "=r"(top));
    for (p = top - DEPTH; p < top - 8; p++) { *p = PAINT; }
    for (k = 0; k < STEPS; k++) { one(k); }
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
    say("stack\\n"); word(stack());
    say("text\\n"); word((uint32_t)(&_block_end - &_block));
    say("library\\n"); word((uint32_t)(&_library_end - &_library));
    say("data\\n"); word((uint32_t)($data));
    start();
    SYST_RVR = 0xFFFFFFu; SYST_CVR = 0u; SYST_CSR = 5u;
    for (k = 0; k < IDLE; k++) { wait(); idle[k] = ticks(nothing, k); }
    for (k = 0; k < STEPS; k++) { wait(); cost[k] = ticks(one, k); keep(k); }
    say("idle\\n");
    for (k = 0; k < IDLE; k++) { word(idle[k]); }
    say("ticks\\n");
    for (k = 0; k < STEPS; k++) { word(cost[k]); }
    say("rows\\n");
    for (i = 0u; i < sizeof Y / 4u; i++) { word(rows[i]); }
    say("end\\n");
    return 0;
}
""")
"""Its parts: `include`, `real`, `steps`, `inputs` (columns), `values`, `columns` (of the results),
`declarations`, and statements: `start`, `step` and `keep` for step k; `data`, bytes."""

TEST = Template("""\
#include <stdint.h>

void say(const char *text);
void word(uint32_t value);
int ${name}_test(void);

int main(void)
{
    say("wrong\\n"); word((uint32_t)${name}_test());
    say("end\\n");
    return 0;
}
""")
"""Says how many results of a kit's unit test are wrong; `name` is that of its C."""
