/* SPDX-License-Identifier: MIT */
#include "child.h"
#include "platform.h"
#include <dirent.h>
#include <errno.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

void *quern_shared_take(size_t bytes) {
	void *memory = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	return memory == MAP_FAILED ? NULL : memory;
}

void quern_shared_drop(void *memory, size_t bytes) {
	if (memory) munmap(memory, bytes);
}

/* ---- what a child may do ---- */

static void limit(__rlimit_resource_t resource, rlim_t most) {
	struct rlimit r;
	if (getrlimit(resource, &r)) return;
	if (r.rlim_max > most) r.rlim_max = most;
	if (r.rlim_cur > r.rlim_max) r.rlim_cur = r.rlim_max;
	setrlimit(resource, &r);
}

/* A limit on processes counts all that the user has, binds no superuser and cannot tell who tried; the kernel's filter of
 * system calls ends the child at its first fork. Threads are let through, and clone3, whose arguments a filter cannot
 * see, is said not to exist: the C library then takes clone. */
static bool forbid_forks(void) {
#if defined __x86_64__ && !defined QUERN_SANITIZED
#define LOAD(member) BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, member))
#define IF(value, then, otherwise) BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, then, otherwise)
#define RETURN(value) BPF_STMT(BPF_RET | BPF_K, value)
	struct sock_filter code[] = { LOAD(arch), IF(AUDIT_ARCH_X86_64, 0, 7), LOAD(nr), IF(SYS_fork, 6, 0),
		IF(SYS_vfork, 5, 0), IF(SYS_clone3, 5, 0), IF(SYS_clone, 0, 2), LOAD(args[0]),
		BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, CLONE_THREAD, 0, 1), RETURN(SECCOMP_RET_ALLOW),
		RETURN(SECCOMP_RET_KILL_PROCESS), RETURN(SECCOMP_RET_ERRNO | ENOSYS) };
	const struct sock_fprog program = { sizeof code / sizeof *code, code };
	return !prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) && !prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program);
#else
	return false;
#endif
}

/* Processes and threads of this user; 0 if that cannot be known. */
static rlim_t tasks_of_user(void) {
	DIR *all = opendir("/proc");
	struct dirent *entry;
	rlim_t n = 0;
	while (all && (entry = readdir(all))) {
		char path[300];
		struct stat is;
		snprintf(path, sizeof path, "/proc/%s/task", entry->d_name);
		if (entry->d_name[0] < '1' || entry->d_name[0] > '9' || stat(path, &is) || is.st_uid != getuid())
			continue;
		n += is.st_nlink - 2; /* a folder for every thread */
	}
	if (all) closedir(all);
	return n;
}

static void set_limits(unsigned seconds) {
	enum { THREADS = 256, FILES = 256 };
	const rlim_t gigabyte = (rlim_t)1 << 30;
	struct stat out;
	const rlim_t printed = !fstat(STDOUT_FILENO, &out) && out.st_size > 0 ? (rlim_t)out.st_size : 0;
	if (!forbid_forks()) {
		const rlim_t now = tasks_of_user();
		if (now) limit(RLIMIT_NPROC, now + THREADS);
	}
#ifndef QUERN_SANITIZED
	limit(RLIMIT_AS, 4 * gigabyte);
#endif
	limit(RLIMIT_CPU, 8 * (rlim_t)seconds + 10); /* of all threads */
	limit(RLIMIT_NOFILE, FILES);
	limit(RLIMIT_FSIZE, printed + gigabyte);
	limit(RLIMIT_CORE, 0);
}

/* ---- a life ---- */

typedef struct {
	void (*work)(void *);
	void *arg;
	unsigned seconds;
	volatile sig_atomic_t *done;
	sigset_t mask;
} errand;

static bool is_one; /* of this process, set once, when such a child begins: see docs/decisions/0013 */

bool quern_child_is_one(void) { return is_one; }

_Noreturn static void live(const errand *e) {
	is_one = true;
	setsid();
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	sigprocmask(SIG_SETMASK, &e->mask, NULL);
	set_limits(e->seconds);
	e->work(e->arg);
	fflush(stdout);
	*e->done = 1;
	_exit(0);
}

static double now(void) {
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* SIGCHLD is blocked. True if the child has ended by itself; it is left there, so that its number is nobody else's. */
static bool wait_for(pid_t child, unsigned seconds) {
	const double until = now() + seconds;
	sigset_t ends;
	sigemptyset(&ends);
	sigaddset(&ends, SIGCHLD);
	for (;;) {
		siginfo_t info = { 0 };
		if (!waitid(P_PID, (id_t)child, &info, WEXITED | WNOHANG | WNOWAIT) && info.si_pid == child)
			return true;
		const double left = until - now();
		if (left <= 0) return false;
		const struct timespec t = { (time_t)left, (long)((left - (double)(time_t)left) * 1e9) };
		sigtimedwait(&ends, NULL, &t);
	}
}

static quern_child judge(const errand *e, bool late, int status) {
	if (late) return (quern_child) { QUERN_CHILD_LATE, 0 };
	if (WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS)
		return (quern_child) { QUERN_CHILD_FORKED, SIGSYS };
	if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
		return (quern_child) { QUERN_CHILD_LATE, SIGXCPU };
	if (WIFSIGNALED(status)) return (quern_child) { QUERN_CHILD_CRASHED, WTERMSIG(status) };
	return (quern_child) { *e->done && !WEXITSTATUS(status) ? QUERN_CHILD_DONE : QUERN_CHILD_ENDED, 0 };
}

quern_child quern_child_run(void (*work)(void *), void *arg, unsigned seconds) {
	errand e = { work, arg, seconds, quern_shared_take(sizeof(sig_atomic_t)), { { 0 } } };
	quern_child how = { QUERN_CHILD_NONE, 0 };
	sigset_t ends;
	int status = 0;
	if (!e.done) return how;
	fflush(NULL);
	sigemptyset(&ends);
	sigaddset(&ends, SIGCHLD);
	signal(SIGCHLD, SIG_DFL); /* whoever ignores it never learns how a child ended */
	sigprocmask(SIG_BLOCK, &ends, &e.mask);
	const pid_t child = fork();
	if (!child) live(&e);
	if (child > 0) {
		const bool late = !wait_for(child, seconds);
		kill(child, SIGKILL);
		kill(-child, SIGKILL); /* with everything that it has left behind */
		while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
		how = judge(&e, late, status);
	}
	const int why = errno;
	sigprocmask(SIG_SETMASK, &e.mask, NULL);
	quern_shared_drop((void *)(uintptr_t)e.done, sizeof(sig_atomic_t));
	errno = why;
	return how;
}

/* ---- words ---- */

const char *quern_signal_name(int number) {
	switch (number) {
	case SIGSEGV: return "SIGSEGV";
	case SIGBUS: return "SIGBUS";
	case SIGFPE: return "SIGFPE";
	case SIGILL: return "SIGILL";
	case SIGABRT: return "SIGABRT";
	case SIGXFSZ: return "SIGXFSZ";
	case SIGKILL: return "SIGKILL";
	default: return "another signal";
	}
}

void quern_child_say(const quern_child *how, unsigned seconds, char out[80]) {
	switch (how->end) {
	case QUERN_CHILD_CRASHED: snprintf(out, 80, "crashed (%s)", quern_signal_name(how->signal)); break;
	case QUERN_CHILD_LATE: snprintf(out, 80, "did not come back within %u s", seconds); break;
	case QUERN_CHILD_ENDED: snprintf(out, 80, "ended the program"); break;
	case QUERN_CHILD_FORKED: snprintf(out, 80, "started a process"); break;
	case QUERN_CHILD_NONE: snprintf(out, 80, "could not be tried (%.40s)", strerror(errno)); break;
	default: snprintf(out, 80, "did nothing wrong"); break;
	}
}
