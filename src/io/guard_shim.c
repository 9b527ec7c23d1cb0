/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: work that may crash is tried in a child first. Called through rockdda_io_guard only. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

/* 0 in a child that is to do the work. In the parent, when the child has ended: 1 it came through, 2 it did not. */
int rockdda_guard_begin(int seconds)
{
   static const int numbers[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGXCPU, SIGALRM};
   struct rlimit none = {0, 0}, time = {(rlim_t)seconds, (rlim_t)seconds + 1};
   int status, silent;
   unsigned i;
   pid_t child = fork();
   if (child < 0) return 1; /* no process to be had: go on without */
   if (child > 0) {
      while (waitpid(child, &status, 0) < 0)
         if (errno != EINTR) return 1;
      return WIFEXITED(status) && WEXITSTATUS(status) == 0 ? 1 : 2;
   }
   for (i = 0; i < sizeof numbers / sizeof numbers[0]; ++i) signal(numbers[i], SIG_DFL);
   silent = open("/dev/null", O_WRONLY);
   if (silent >= 0) {
      dup2(silent, STDOUT_FILENO);
      dup2(silent, STDERR_FILENO);
      close(silent);
   }
   setrlimit(RLIMIT_CORE, &none);
   setrlimit(RLIMIT_CPU, &time);
   alarm(20U * (unsigned)seconds);
   return 0;
}

/* The end of the child. */
void rockdda_guard_end(void)
{
   _exit(0);
}
