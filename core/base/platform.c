/* SPDX-License-Identifier: MIT */
#include "platform.h"
#include "text.h"
#include <limits.h>
#include <malloc.h>
#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

/* Quota over period of a container, in processors; INFINITY where there is none. */
static double quota_of(const char *quota_file, const char *period_file) {
	char quota[32] = "";
	double period = 0, amount = 0;
	FILE *file = fopen(quota_file, "r");
	if (!file) return INFINITY;
	const int n = fscanf(file, "%31s %lf", quota, &period);
	fclose(file);
	if (n == 1 && period_file && (file = fopen(period_file, "r"))) {
		if (fscanf(file, "%lf", &period) != 1) period = 0;
		fclose(file);
	}
	if (sscanf(quota, "%lf", &amount) != 1 || !(amount > 0 && period > 0)) return INFINITY; /* "max", or -1 */
	return amount / period;
}

uint32_t quern_platform_processors(void) {
	cpu_set_t set;
	CPU_ZERO(&set);
	const int bound = sched_getaffinity(0, sizeof set, &set) ? 1 : CPU_COUNT(&set);
	const double now = quota_of("/sys/fs/cgroup/cpu.max", NULL);
	const double old =
		quota_of("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "/sys/fs/cgroup/cpu/cpu.cfs_period_us");
	const double paid = ceil(fmin(now, old));
	const double most = fmin(paid, bound);
	return most < 1 ? 1 : (uint32_t)most;
}

void quern_platform_pause(void) {
#if defined(__x86_64__)
	__builtin_ia32_pause();
#elif defined(__aarch64__)
	__asm__ volatile("isb");
#endif
}

uint64_t quern_platform_ticks(void) {
#if defined(__x86_64__)
	return __builtin_ia32_rdtsc();
#else
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
#endif
}

char *quern_platform_program(void) {
	char path[PATH_MAX];
	const ssize_t n = readlink("/proc/self/exe", path, sizeof path - 1);
	if (n <= 0) return NULL;
	path[n] = 0;
	return quern_copy(path);
}

void *quern_platform_memory(size_t bytes) {
	const size_t page = (size_t)2 << 20, line = 64, unit = bytes < page / 2 ? line : page;
	if (bytes > SIZE_MAX - page) return NULL;
	const size_t size = (bytes + unit - 1) / unit * unit;
	void *memory = aligned_alloc(unit, size);
#ifdef MADV_HUGEPAGE
	/* without them it is memory all the same; the last one may be large only if little of it stays unused */
	const size_t large = size - bytes <= bytes / 32 ? size : size - page;
	if (memory && unit == page && large) madvise(memory, large, MADV_HUGEPAGE);
#endif
	return memory;
}

void quern_platform_forget(void *memory, size_t bytes) {
	const size_t page = (size_t)sysconf(_SC_PAGESIZE), before = (page - (uintptr_t)memory % page) % page;
	if (bytes > before + page)
		madvise((char *)memory + before, (bytes - before) / page * page, MADV_DONTNEED);
}

void quern_platform_begin(void) {
#ifdef M_MMAP_THRESHOLD
	mallopt(M_MMAP_THRESHOLD, 1 << 20);
	mallopt(M_TRIM_THRESHOLD, 1 << 23);
#endif
}

void quern_platform_trim(void) {
#ifdef M_TRIM_THRESHOLD
	malloc_trim(0);
#endif
}

int64_t quern_platform_peak_memory(void) {
	/* getrusage would tell that of the process that has forked this one, if it was more */
	FILE *file = fopen("/proc/self/status", "r");
	if (!file) return 0;
	char line[256];
	long long kib = 0;
	while (fgets(line, sizeof line, file))
		if (sscanf(line, "VmHWM: %lld", &kib) == 1) break;
	fclose(file);
	return kib * 1024;
}
