/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: streams, signals, terminal, and an end of the process that tells a bug from an error. */
#define _XOPEN_SOURCE 700
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static volatile sig_atomic_t signal_seen = 0; /* first stop signal */
static volatile sig_atomic_t writing = 0;     /* output is being written: do not leave now */
static volatile sig_atomic_t leaving = 0;     /* leave when it is written */
static volatile sig_atomic_t orderly = 0;     /* the program chose to end */

/* What stands on standard output when the process leaves at once, NULL when nothing is to. */
static char *volatile last_words = NULL;

/* Stop signals in the order of their numbers for Fortran, from 1. Schedulers say with SIGUSR2 (LSF, Grid Engine) and
 * SIGXCPU (limits of processor time) what Slurm says with SIGUSR1; SIGHUP comes when a terminal is closed. */
static const int stop_signals[] = {SIGTERM, SIGINT, SIGUSR1, SIGUSR2, SIGXCPU, SIGHUP};
enum { N_STOP_SIGNALS = sizeof stop_signals / sizeof stop_signals[0] };

static const char bug_message[] =
   "\nrockdda: internal error: this is a bug in RockDDA. Please report it with the command line, the input files and\n"
   "the lines above; `rockdda --version` says what else is needed.\n";
static const char stop_message[] =
   "\nrockdda: stopped at once; the results hold everything up to their last flush, 'rockdda resume' continues from the\n"
   "last checkpoint\n";

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

static void at_end(void)
{
   if (orderly) return;
   say(bug_message); /* the run-time library ended the program */
   _exit(1);
}

static void on_crash(int number)
{
   (void)number;
   say(bug_message);
   _exit(1);
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

static void handle(int number, void (*handler)(int), int flags)
{
   struct sigaction action;
   memset(&action, 0, sizeof action);
   action.sa_handler = handler;
   action.sa_flags = flags;
   sigemptyset(&action.sa_mask);
   sigaction(number, &action, NULL);
}

/* The number of a stream that is closed would go to the next file that is opened, and messages into the results:
 * put something there that refuses them. */
static void occupy_streams(void)
{
   int stream;
   for (stream = STDIN_FILENO; stream <= STDERR_FILENO; stream++) {
      if (fcntl(stream, F_GETFD) != -1 || errno != EBADF) continue;
      if (open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
   }
}

void rockdda_process_start(void)
{
   occupy_streams();
   atexit(at_end);
#if !defined(__SANITIZE_ADDRESS__)
   handle(SIGSEGV, on_crash, SA_RESETHAND);
   handle(SIGBUS, on_crash, SA_RESETHAND);
   handle(SIGFPE, on_crash, SA_RESETHAND);
   handle(SIGILL, on_crash, SA_RESETHAND);
   handle(SIGABRT, on_crash, SA_RESETHAND);
#endif
   handle(SIGXFSZ, SIG_IGN, 0); /* a file size limit is then an ordinary write error */
   handle(SIGPIPE, SIG_IGN, 0); /* and so is a reader of the messages that has gone: no reason to end a run */
   handle(SIGQUIT, SIG_DFL, 0); /* without a trace by the run-time library */
}

void rockdda_process_exit(int code)
{
   orderly = 1;
   exit(code);
}

void rockdda_process_watch_signals(void)
{
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

/* Keep what is to stand on standard output when a second SIGINT ends the process. */
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

void rockdda_process_set_writing(int yes)
{
   writing = yes;
   if (!yes && leaving) leave();
}

int rockdda_process_is_terminal(int descriptor)
{
   return isatty(descriptor);
}
