// Prints the widest vectors that this processor, or the one it is made to look like, has for percuss [bits].
#include <stdio.h>

int main(void) {
    __builtin_cpu_init();
    int has_256 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    puts(__builtin_cpu_supports("avx512f") ? "512" : has_256 ? "256" : "128");
}
