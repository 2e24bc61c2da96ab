/* SPDX-License-Identifier: MIT */
#include "watch.h"
#include "child.h"
#include "platform.h"
#include <dlfcn.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

enum { STATUS = 3, STACK = 1 << 16 };

/* A handler is given nothing, so what it says has to lie here. */
static struct {
	const char *volatile plugin, *volatile function; /* NULL: none is called */
	const quern_loader *volatile loader;
	volatile int *own; /* 1 in this process, 0 in its copies */
	bool terminal;
	char kept[256];
	atomic_flag speaks;
	void (*see)(void *, const char *, const char *);
	void *seer;
} watch = { .speaks = ATOMIC_FLAG_INIT };

/* ---- saying it, with nothing but write() ---- */

typedef struct {
	char data[1024];
	size_t n;
} line;

static void add(line *l, const char *text) {
	for (; text && *text && l->n < sizeof l->data - 1; text++) l->data[l->n++] = *text;
}

static void add_hex(line *l, uintptr_t value) {
	char digits[2 * sizeof value + 1] = "";
	size_t n = sizeof digits - 1;
	do digits[--n] = "0123456789abcdef"[value & 15];
	while (value >>= 4);
	add(l, "0x");
	add(l, digits + n);
}

/* ---- who it was ---- */

static bool is_called(void) { return watch.plugin && watch.own && *watch.own; }

static const quern_plugin_file *plugin_at(uintptr_t address) {
	for (size_t i = 0; watch.loader && i < quern_loader_count(watch.loader); i++) {
		const quern_plugin_file *f = quern_loader_at(watch.loader, i);
		if (address >= f->begin && address < f->end) return f;
	}
	return NULL;
}

/* Which function of the ops begins next below; helpers of the plugin pass for the one they follow. */
static const char *function_at(const quern_plugin_file *f, uintptr_t address) {
	const char *name = NULL;
	uintptr_t best = 0;
	const quern_plugin_view *view = f->n_views ? &f->views[0] : NULL;
	for (const quern_function *o = view ? view->kind->functions : NULL; o && o->name; o++) {
		uintptr_t at;
		memcpy(&at, (const char *)view->ops + o->offset, sizeof at);
		if (at && at <= address && at > best) best = at, name = o->name;
	}
	return name;
}

/* "quern: error: PLUGIN crashed in FUNCTION, called by STAGE, at FILE+0x1234; out/x keeps ..." */
static void say(const char *what, uintptr_t address) {
	const quern_plugin_file *f = plugin_at(address);
	const bool other =
		f && strcmp(f->plugin.id, watch.plugin) != 0; /* called by the one that we have called */
	line l = { .n = 0 };
	add(&l, watch.terminal ? "\r\033[Kquern: error: " : "quern: error: ");
	add(&l, other ? f->plugin.id : watch.plugin);
	add(&l, what);
	if (other && function_at(f, address)) add(&l, function_at(f, address)), add(&l, ", called by ");
	else if (other) add(&l, "a call by ");
	add(&l, watch.function);
	if (f) {
		add(&l, ", at ");
		add(&l, f->path);
		add(&l, "+");
		add_hex(&l, address - f->begin);
	}
	add(&l, watch.kept[0] ? "; " : "");
	add(&l, watch.kept);
	add(&l, "\n");
	const ssize_t n = write(STDERR_FILENO, l.data, l.n);
	(void)n;
}

_Noreturn static void end(int status) {
	syscall(SYS_exit_group, status);
	for (;;) continue;
}

/* ---- ends of the program ---- */

static const char ended[] = " ended the program in ";

/* Whatever comes to the C library's exit() or quick_exit() without passing below. */
static void at_end(void) {
	if (!is_called()) return;
	say(ended, 0);
	end(STATUS);
}

#ifndef QUERN_SANITIZED
/* A plugin that calls one of these finds the program's, which comes before the C library's, and is known by the address it
 * would return to. All others get what they asked for. */
_Noreturn static void leave(uintptr_t caller) {
	say(ended, caller);
	end(STATUS);
}

_Noreturn void _exit(int status) {
	if (is_called()) leave((uintptr_t)__builtin_return_address(0));
	end(status);
}

_Noreturn void _Exit(int status) {
	if (is_called()) leave((uintptr_t)__builtin_return_address(0));
	end(status);
}

_Noreturn void exit(int status) {
	if (is_called()) leave((uintptr_t)__builtin_return_address(0));
	void (*next)(int) = (void (*)(int))(uintptr_t)dlsym(RTLD_NEXT, "exit");
	if (next) next(status);
	end(status);
}
#endif

/* ---- crashes ---- */

static uintptr_t address_of(const void *context) {
#if defined __x86_64__
	return (uintptr_t)((const ucontext_t *)context)->uc_mcontext.gregs[REG_RIP];
#elif defined __aarch64__
	return (uintptr_t)((const ucontext_t *)context)->uc_mcontext.pc;
#else
	return (void)context, 0;
#endif
}

static void on_crash(int number, siginfo_t *info, void *context) {
	char what[48] = " crashed (";
	(void)info;
	if (!is_called()) { /* the program's own fault: as if nobody had asked */
		signal(number, SIG_DFL);
		raise(number);
		return;
	}
	while (atomic_flag_test_and_set(&watch.speaks)) pause(); /* another worker is dying already */
	strncat(what, quern_signal_name(number), 24);
	strncat(what, ") in ", 8);
	say(what, address_of(context));
	end(STATUS);
}

static void catch_crashes(void) {
#ifndef QUERN_SANITIZED
	static const int numbers[] = { SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT };
	static _Alignas(64) char stack[STACK]; /* where an endless recursion leaves none */
	const stack_t own = { .ss_sp = stack, .ss_size = sizeof stack };
	struct sigaction action = { .sa_sigaction = on_crash, .sa_flags = SA_SIGINFO | SA_ONSTACK };
	sigemptyset(&action.sa_mask);
	sigaltstack(&own, NULL);
	for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) sigaction(numbers[i], &action, NULL);
#else
	(void)on_crash;
#endif
}

/* ---- marks ---- */

void quern_watch_begin(void) {
	if (watch.own) return;
	int *own = mmap(NULL, sizeof *own, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
	if (own == MAP_FAILED) return;
	madvise(own, sizeof *own, MADV_WIPEONFORK);
	*own = 1;
	watch.own = own;
	watch.terminal = isatty(STDERR_FILENO);
	atexit(at_end);
	at_quick_exit(at_end);
	catch_crashes();
}

void quern_watch_know(const quern_loader *loader) { watch.loader = loader; }

void quern_watch_enter(const char *plugin, const char *function) {
	if (watch.see) watch.see(watch.seer, plugin, function);
	watch.function = function;
	watch.plugin = plugin;
}

void quern_watch_leave(void) {
	watch.plugin = NULL;
	if (watch.own && !*watch.own) end(STATUS);
	if (watch.see) watch.see(watch.seer, NULL, NULL);
}

void quern_watch_follow(void (*see)(void *, const char *, const char *), void *arg) {
	watch.seer = arg;
	watch.see = see;
}

void quern_watch_keep(const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	vsnprintf(watch.kept, sizeof watch.kept, fmt, list);
	va_end(list);
}
