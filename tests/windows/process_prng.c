// bcryptprimitives.dll, which programs of Rust take their random seeds from and Wine before version 9 does not have.
// x86_64-w64-mingw32-gcc -shared -o bcryptprimitives.dll process_prng.c
#include <windows.h>
#include <ntsecapi.h>

__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE bytes, SIZE_T length) {
    return RtlGenRandom(bytes, length);
}
