/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: streams, signals, terminal, and the end of the process, by a bug or by an error. */
#define _XOPEN_SOURCE 700
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

const char *rockdda_guard_file_being_read(void);
void rockdda_guard_out_of_memory(void);
void rockdda_leave(int code);
int rockdda_memory_is_gone(void);
int rockdda_memory_is_there(size_t bytes);
void rockdda_process_out_of_memory(size_t bytes);
void rockdda_process_missing_library(const char *name, const char *reason);

static volatile sig_atomic_t signal_seen = 0; /* first stop signal */
static volatile sig_atomic_t writing = 0;     /* output is being written: do not exit now */
static volatile sig_atomic_t leaving = 0;     /* exit when it is written */
static volatile sig_atomic_t orderly = 0;     /* the program ended by itself */
static volatile sig_atomic_t watching = 0;    /* a run is active */

/* The command that prints a JSON summary in all cases, '' for none. */
static char json_command[32] = "";

/* Text for standard output when the process exits at once, NULL: none. */
static char *volatile last_words = NULL;

/* Stop signals in the order of their numbers for Fortran, from 1. Slurm sends SIGUSR1, LSF and Grid Engine SIGUSR2,
 * limits of processor time SIGXCPU; SIGHUP comes when a terminal is closed. */
static const int stop_signals[] = {SIGTERM, SIGINT, SIGUSR1, SIGUSR2, SIGXCPU, SIGHUP};
enum { N_STOP_SIGNALS = sizeof stop_signals / sizeof stop_signals[0] };

static const char bug_message[] =
   "\nrockdda: internal error: this is a bug in RockDDA. Please report it with the command line, the input files and\n"
   "the lines above; `rockdda --version` says what else is needed.\n";
static const char stop_message[] =
   "\nrockdda: stopped at once; the results hold everything up to their last flush, 'rockdda resume' continues from the\n"
   "last checkpoint\n";

static const char memory_message[] =
   "; give the program more (ulimit -v, --mem of a batch system), or a smaller model\n";
static const char kept_message[] = "rockdda: the results so far are kept\n";

/* The preferred and the smallest sufficient stack: OpenBLAS and HDF5 keep large arrays there
 * [bytes]. */
#define WANTED_STACK ((rlim_t)8 << 20)
#define SMALLEST_STACK ((rlim_t)512 << 10)

/* Set when the program was restarted with a larger stack. */
static const char stack_mark[] = "ROCKDDA_STACK_RAISED";

/* Where libraries may wait for more memory [bytes]. */
enum { SCARCE = 256 << 20 };

static void tell(int stream, const char *text)
{
   size_t n = strlen(text), done = 0;
   while (done < n) {
      ssize_t written = write(stream, text + done, n - done);
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return;
      done += (size_t)written;
   }
}

static void say(const char *text)
{
   tell(STDERR_FILENO, text);
}

/* The summary of a command that ends by a failure. */
static void summarise(const char *code, const char *reason)
{
   if (json_command[0] == '\0') return;
   tell(STDOUT_FILENO, "{\"command\": \"");
   tell(STDOUT_FILENO, json_command);
   tell(STDOUT_FILENO, "\", \"status\": \"error\", \"exit_code\": ");
   tell(STDOUT_FILENO, code);
   tell(STDOUT_FILENO, ", \"exit_reason\": \"");
   tell(STDOUT_FILENO, reason);
   tell(STDOUT_FILENO, "\", \"errors\": 1, \"warnings\": 0, \"messages\": [{\"severity\": \"error\", \"message\": \"");
   tell(STDOUT_FILENO, reason);
   tell(STDOUT_FILENO, "\"}]}\n");
}

/* An allocation failed (its size in bytes, 0: unknown). Ends the process without allocating. */
void rockdda_process_out_of_memory(size_t bytes)
{
   char digits[24];
   char *first = digits + sizeof digits - 1;
   orderly = 1;
   rockdda_guard_out_of_memory();
   say("\nrockdda: out of memory");
   if (bytes > 0) {
      *first = '\0';
      for (; bytes > 0; bytes /= 10) *--first = (char)('0' + bytes % 10);
      say(": ");
      say(first);
      say(" bytes more are refused");
   }
   say(memory_message);
   if (watching) say(kept_message);
   summarise("3", "out of memory");
   rockdda_leave(3);
}

/* A library that is loaded when it is needed cannot be loaded (src/late/late.c). */
void rockdda_process_missing_library(const char *name, const char *reason)
{
   if (rockdda_memory_is_gone()) rockdda_process_out_of_memory(0);
   orderly = 1;
   say("\nrockdda: cannot load ");
   say(name);
   say(", which the solvers 'cholmod' and 'dense' need: ");
   say(reason ? reason : "a procedure is missing");
   say("; install it, or choose the solver pcg\n");
   if (watching) say(kept_message);
   summarise("3", "a library is missing");
   rockdda_leave(3);
}

/* The end was not requested by the program: a library or the run-time library of Fortran called exit. */
static void give_up(void)
{
   const char *file = rockdda_guard_file_being_read();
   if (rockdda_memory_is_gone()) rockdda_process_out_of_memory(0);
   if (file[0] != '\0') {
      say(file);
      say(": error: the file is damaged: HDF5 cannot read it\n");
      summarise("2", "a file is damaged");
      _exit(2);
   }
   say(bug_message);
   summarise("1", "internal error");
   _exit(1);
}

static void at_end(void)
{
   if (!orderly) give_up();
}

static void on_crash(int number)
{
   (void)number;
   give_up();
}

static void leave(void)
{
   say(stop_message);
   if (last_words) tell(STDOUT_FILENO, last_words);
   _exit(4);
}

static void on_stop(int number)
{
   if (signal_seen != 0 && number == SIGINT) {
      if (!writing) leave();
      leaving = 1;
   }
   if (signal_seen == 0) signal_seen = number;
}

/* Stack for the handler of crashes: the ordinary one may be exhausted. */
static void prepare_stack(void)
{
   static char room[1 << 16];
   stack_t stack;
   memset(&stack, 0, sizeof stack);
   stack.ss_sp = room;
   stack.ss_size = sizeof room;
   sigaltstack(&stack, NULL);
}

static void handle(int number, void (*handler)(int), int flags)
{
   struct sigaction action;
   memset(&action, 0, sizeof action);
   action.sa_handler = handler;
   action.sa_flags = flags;
   sigemptyset(&action.sa_mask);
   sigaction(number, &action, NULL);
}

/* The descriptor of a closed stream would be used for the next file, and messages would go into the results:
 * occupy it with a file that rejects them. */
static void occupy_streams(void)
{
   int stream;
   for (stream = STDIN_FILENO; stream <= STDERR_FILENO; stream++) {
      if (fcntl(stream, F_GETFD) != -1 || errno != EBADF) continue;
      if (open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
   }
}

/* Restart this program with the same arguments. Returns when that is not possible. */
static void start_anew(void)
{
   char *text = NULL, *larger, **arguments;
   size_t room = 0, size = 0, n = 0, i;
   ssize_t got = 1;
   int file = open("/proc/self/cmdline", O_RDONLY | O_CLOEXEC);
   while (file >= 0 && got > 0) {
      room = 2 * room + 4096;
      larger = realloc(text, room);
      if (larger == NULL) break;
      text = larger;
      while (size < room - 1 && (got = read(file, text + size, room - 1 - size)) > 0) size += (size_t)got;
   }
   if (file >= 0) close(file);
   for (i = 0; i < size; i++) n += text[i] == '\0';
   arguments = calloc(n + 1, sizeof *arguments);
   if (n == 0 || got != 0 || arguments == NULL) return;
   for (i = 0, n = 0; i < size; i += strlen(text + i) + 1) arguments[n++] = text + i;
   execv("/proc/self/exe", arguments);
}

/* A small stack (ulimit -s) would end as a crash. Threads take their stacks from the limit of the moment when the
 * libraries were loaded, so that a raised limit needs a restart of the program; the process number stays the same. */
static void raise_stack(void)
{
   struct rlimit stack;
   rlim_t before;
   char digits[24];
   char *first = digits + sizeof digits - 1;
   if (getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur == RLIM_INFINITY || stack.rlim_cur >= WANTED_STACK) return;
   before = stack.rlim_cur;
   stack.rlim_cur = WANTED_STACK;
   if (stack.rlim_max != RLIM_INFINITY && stack.rlim_max < WANTED_STACK) stack.rlim_cur = stack.rlim_max;
   if (stack.rlim_cur > before && getenv(stack_mark) == NULL && setrlimit(RLIMIT_STACK, &stack) == 0 &&
       setenv(stack_mark, "1", 1) == 0)
      start_anew();
   unsetenv(stack_mark);
   if (before >= SMALLEST_STACK) return;
   orderly = 1;
   *first = '\0';
   for (before >>= 10; before > 0; before /= 10) *--first = (char)('0' + before % 10);
   say("rockdda: error: the stack is limited to ");
   say(first);
   say(" kB (ulimit -s); the program needs 512 kB, better 8192 kB\n");
   _exit(3);
}

/* Keep memory that is given back, up to a limit: a step gives back arrays of some MB and takes them again, and the
 * system clears each page anew, which takes longer than computing with it. */
static void keep_memory(void)
{
#ifdef __GLIBC__
   mallopt(M_MMAP_THRESHOLD, 32 << 20); /* the largest value */
   mallopt(M_TRIM_THRESHOLD, 256 << 20);
   mallopt(M_TOP_PAD, 4 << 20);
#endif
}

void rockdda_process_start(void)
{
   keep_memory();
   occupy_streams();
   raise_stack();
   atexit(at_end);
#if !defined(__SANITIZE_ADDRESS__)
   prepare_stack();
   handle(SIGSEGV, on_crash, SA_RESETHAND | SA_ONSTACK);
   handle(SIGBUS, on_crash, SA_RESETHAND | SA_ONSTACK);
   handle(SIGFPE, on_crash, SA_RESETHAND);
   handle(SIGILL, on_crash, SA_RESETHAND);
   handle(SIGABRT, on_crash, SA_RESETHAND);
#endif
   handle(SIGXFSZ, SIG_IGN, 0); /* a file size limit is then an ordinary write error */
   handle(SIGPIPE, SIG_IGN, 0); /* and so is a closed pipe of messages: no reason to end a run */
   handle(SIGQUIT, SIG_DFL, 0); /* without a trace by the run-time library */
}

void rockdda_process_exit(int code)
{
   char *words = last_words;
   last_words = NULL;
   free(words);
   orderly = 1;
   /* threads of OpenBLAS repeat failed allocations for ever, and its exit waits for its threads */
   if (!rockdda_memory_is_there(SCARCE)) rockdda_leave(code);
   exit(code);
}

void rockdda_process_watch_signals(void)
{
   watching = 1;
   struct sigaction before;
   int i;
   for (i = 0; i < N_STOP_SIGNALS; i++) {
      /* nohup */
      if (stop_signals[i] == SIGHUP && sigaction(SIGHUP, NULL, &before) == 0 && before.sa_handler == SIG_IGN) continue;
      handle(stop_signals[i], on_stop, SA_RESTART);
   }
}

/* 0 none, else the place in the list of stop signals, from 1 */
int rockdda_process_signal(void)
{
   int i;
   for (i = 0; i < N_STOP_SIGNALS; i++)
      if (stop_signals[i] == signal_seen) return i + 1;
   return 0;
}

/* Set the text for standard output when a second SIGINT ends the process. */
void rockdda_process_set_last_words(const char *text, int n)
{
   sigset_t interrupt, before;
   char *old = last_words, *words = malloc((size_t)n + 1);
   if (!words) return;
   memcpy(words, text, (size_t)n);
   words[n] = '\0';
   sigemptyset(&interrupt);
   sigaddset(&interrupt, SIGINT);
   sigprocmask(SIG_BLOCK, &interrupt, &before);
   last_words = words;
   free(old);
   sigprocmask(SIG_SETMASK, &before, NULL);
}

/* Set the command that prints a JSON summary, also at a sudden end. */
void rockdda_process_promise_json(const char *command, int n)
{
   if ((size_t)n >= sizeof json_command) return;
   memcpy(json_command, command, (size_t)n);
   json_command[n] = '\0';
}

void rockdda_process_set_writing(int yes)
{
   writing = yes;
   if (!yes && leaving) leave();
}

int rockdda_process_is_terminal(int descriptor)
{
   return isatty(descriptor);
}

int rockdda_process_columns(int descriptor)
{
   struct winsize size;
   if (ioctl(descriptor, TIOCGWINSZ, &size) != 0) return 0;
   return size.ws_col;
}
