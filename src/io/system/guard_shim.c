/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim: run work that may crash in a child process. Called through rockdda_io_guard only. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <string.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

enum { IN_CHILD = 0, PASSED = 1, CRASHED = 2, NO_PROCESS = 3, REFUSED = 4, NO_MEMORY = 5 };

/* Exit codes of the child at the end of its work, which no aborting library uses. */
enum { DONE = 117, NOT_DONE = 118, REFUSED_MEMORY = 119 };

void rockdda_leave(int code);
int rockdda_memory_is_gone(void);

void rockdda_guard_begin_reading(const char *path);
void rockdda_guard_end_reading(void);
const char *rockdda_guard_file_being_read(void);

/* In the child: descriptor for its message. */
static int report = -1;

/* The file that a library reads and may not survive, '': none. */
static char file_being_read[4096] = "";

void rockdda_guard_begin_reading(const char *path)
{
   strncpy(file_being_read, path, sizeof file_being_read - 1);
}

void rockdda_guard_end_reading(void)
{
   file_being_read[0] = '\0';
}

const char *rockdda_guard_file_being_read(void)
{
   return file_being_read;
}

/* Read the message of the child until its end. */
static void read_message(int from, char *message, int room)
{
   int used = 0;
   memset(message, ' ', (size_t)room);
   for (;;) {
      char rest[256];
      ssize_t n = used < room ? read(from, message + used, (size_t)(room - used)) : read(from, rest, sizeof rest);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return;
      if (used < room) used += (int)n;
   }
}

/* Returns IN_CHILD in the child. In the parent, after the end of the child: PASSED, CRASHED (or it exceeded its time),
 * REFUSED with its message, padded with blanks, or NO_MEMORY. */
int rockdda_guard_begin(double seconds, char *message, int room)
{
   static const int numbers[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGXCPU, SIGPROF, SIGALRM};
   struct rlimit none = {0, 0};
   struct itimerval time = {{0, 0}, {0, 0}};
   int status, silent, ends[2];
   unsigned i;
   pid_t child, parent = getpid();
   if (pipe(ends) != 0) return NO_PROCESS;
   child = fork();
   if (child < 0) {
      close(ends[0]);
      close(ends[1]);
      return NO_PROCESS;
   }
   if (child > 0) {
      close(ends[1]);
      read_message(ends[0], message, room);
      close(ends[0]);
      while (waitpid(child, &status, 0) < 0)
         if (errno != EINTR) return NO_PROCESS;
      if (WIFEXITED(status) && WEXITSTATUS(status) == DONE) return PASSED;
      if (WIFEXITED(status) && WEXITSTATUS(status) == NOT_DONE) return REFUSED;
      if (WIFEXITED(status) && WEXITSTATUS(status) == REFUSED_MEMORY) return NO_MEMORY;
      return rockdda_memory_is_gone() ? NO_MEMORY : CRASHED;
   }
   close(ends[0]);
   report = ends[1];
#ifdef __linux__
   /* end with the parent */
   prctl(PR_SET_PDEATHSIG, SIGKILL);
   if (getppid() != parent) _exit(NOT_DONE);
#else
   (void)parent;
#endif
   for (i = 0; i < sizeof numbers / sizeof numbers[0]; ++i) signal(numbers[i], SIG_DFL);
   silent = open("/dev/null", O_WRONLY);
   if (silent >= 0) {
      dup2(silent, STDOUT_FILENO);
      dup2(silent, STDERR_FILENO);
      close(silent);
   }
   setrlimit(RLIMIT_CORE, &none);
   time.it_value.tv_sec = (time_t)seconds;
   time.it_value.tv_usec = (suseconds_t)(1e6 * (seconds - (double)time.it_value.tv_sec));
   setitimer(ITIMER_PROF, &time, NULL);
   alarm(10U + 20U * (unsigned)seconds);
   return IN_CHILD;
}

void rockdda_guard_out_of_memory(void);

/* Memory is refused: end the child; in the parent nothing happens. */
void rockdda_guard_out_of_memory(void)
{
   if (report >= 0) rockdda_leave(REFUSED_MEMORY);
}

/* End the child; with a message the outcome is REFUSED. */
void rockdda_guard_end(const char *message, int n)
{
   int done = 0;
   while (done < n) {
      ssize_t written = write(report, message + done, (size_t)(n - done));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) break;
      done += (int)written;
   }
   rockdda_leave(n > 0 ? NOT_DONE : DONE);
}
