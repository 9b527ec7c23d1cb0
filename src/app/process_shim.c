/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: signals, terminal, and an end of the process that tells a bug from an error. */
#define _POSIX_C_SOURCE 200809L
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static volatile sig_atomic_t signal_seen = 0; /* first stop signal */
static volatile sig_atomic_t writing = 0;     /* output is being written: do not leave now */
static volatile sig_atomic_t leaving = 0;     /* leave when it is written */
static volatile sig_atomic_t orderly = 0;     /* the program chose to end */

static const char bug_message[] =
   "\nrockdda: internal error: this is a bug in RockDDA. Please report it with the command line, the input files and\n"
   "the lines above; `rockdda --version` says what else is needed.\n";
static const char stop_message[] =
   "\nrockdda: stopped at once; the results hold everything up to their last flush, 'rockdda resume' continues from the\n"
   "last checkpoint\n";

static void say(const char *text)
{
   if (write(STDERR_FILENO, text, strlen(text)) < 0) return;
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

void rockdda_process_start(void)
{
   atexit(at_end);
#if !defined(__SANITIZE_ADDRESS__)
   handle(SIGSEGV, on_crash, SA_RESETHAND);
   handle(SIGBUS, on_crash, SA_RESETHAND);
   handle(SIGFPE, on_crash, SA_RESETHAND);
   handle(SIGILL, on_crash, SA_RESETHAND);
   handle(SIGABRT, on_crash, SA_RESETHAND);
#endif
   handle(SIGXFSZ, SIG_IGN, 0); /* a file size limit is then an ordinary write error */
}

void rockdda_process_exit(int code)
{
   orderly = 1;
   exit(code);
}

void rockdda_process_watch_signals(void)
{
   handle(SIGTERM, on_stop, SA_RESTART);
   handle(SIGINT, on_stop, SA_RESTART);
   handle(SIGUSR1, on_stop, SA_RESTART);
}

/* 0 none, 1 SIGTERM, 2 SIGINT, 3 SIGUSR1 */
int rockdda_process_signal(void)
{
   switch (signal_seen) {
   case 0: return 0;
   case SIGTERM: return 1;
   case SIGINT: return 2;
   default: return 3;
   }
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
