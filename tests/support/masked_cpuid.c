/* Preloaded, it hides what the processor has above the level of x86-64 in X86_64_LEVEL: 2 is without AVX2, 3 without
 * AVX-512. CPUID is made to fault (Linux, processors that can), and answered in the handler. */
#define _GNU_SOURCE
#include <signal.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

enum { ARCH_CPUID = 0x1012, UNAVAILABLE = 77, NOT_CPUID = 78 };

/* Leaf 7, EBX. */
static const unsigned AVX2 = 1u << 5;
static const unsigned AVX512 = 0xdc230000u;

static int level;

static long let_cpuid_run(unsigned long may_run) { return syscall(SYS_arch_prctl, ARCH_CPUID, may_run); }

static void answer(int number, siginfo_t *info, void *context)
{
    (void)number;
    (void)info;
    greg_t *registers = ((ucontext_t *)context)->uc_mcontext.gregs;
    const unsigned char *instruction = (const unsigned char *)registers[REG_RIP];
    if (instruction[0] != 0x0f || instruction[1] != 0xa2)
        _exit(NOT_CPUID);
    unsigned a = registers[REG_RAX], b, c = registers[REG_RCX], d;
    int is_features = a == 7 && c == 0;
    let_cpuid_run(1);
    __asm__ volatile("cpuid" : "+a"(a), "=b"(b), "+c"(c), "=d"(d));
    let_cpuid_run(0);
    if (is_features && level < 4)
        b &= ~AVX512;
    if (is_features && level < 3)
        b &= ~AVX2;
    registers[REG_RAX] = a;
    registers[REG_RBX] = b;
    registers[REG_RCX] = c;
    registers[REG_RDX] = d;
    registers[REG_RIP] += 2;
}

__attribute__((constructor)) static void start(void)
{
    const char *wanted = getenv("X86_64_LEVEL");
    level = wanted ? atoi(wanted) : 4;
    struct sigaction action = {.sa_flags = SA_SIGINFO};
    action.sa_sigaction = answer;
    if (sigaction(SIGSEGV, &action, NULL) || let_cpuid_run(0))
        _exit(UNAVAILABLE);
}
