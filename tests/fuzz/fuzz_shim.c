/* SPDX-License-Identifier: MIT */
/* Thin POSIX shim of the fuzzer: children with limits, memory shared with them, folders. */
#define _GNU_SOURCE
#include <dirent.h>
#include <fcntl.h>
#include <fenv.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* Numbers are mad here: a build that traps overflow must not end the fuzzer, nor every second child. */
void fuzz_trap_nothing(void)
{
   fedisableexcept(FE_ALL_EXCEPT);
}

/* A new process: 0 in the child, its number in the parent, -1 when there can be none. */
int fuzz_fork(void)
{
   fflush(NULL);
   return (int)fork();
}

static void limit(int resource, rlim_t soft, rlim_t hard)
{
   struct rlimit value = {soft, hard};
   setrlimit(resource, &value);
}

/* In the child: output goes to a file; processor time, time, memory above the present use [MB, 0: any] and size of
   files are limited; no core is dumped. Signals do what they do in a fresh process. */
void fuzz_limit(const char *output, int seconds, int wall_seconds, int megabytes)
{
   int file = open(output, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND, 0666);
   if (file >= 0) {
      dup2(file, 1);
      dup2(file, 2);
      close(file);
   }
   file = open("/dev/null", O_RDONLY);
   if (file >= 0) {
      dup2(file, 0);
      close(file);
   }
   limit(RLIMIT_CORE, 0, 0);
   limit(RLIMIT_CPU, (rlim_t)seconds, (rlim_t)seconds + 5);
   limit(RLIMIT_FSIZE, (rlim_t)1 << 28, (rlim_t)1 << 28);
   if (megabytes > 0) {
      unsigned long pages = 0;
      FILE *statm = fopen("/proc/self/statm", "r");
      if (statm != NULL) {
         if (fscanf(statm, "%lu", &pages) != 1) pages = 0;
         fclose(statm);
      }
      limit(RLIMIT_AS, (rlim_t)pages * (rlim_t)sysconf(_SC_PAGESIZE) + ((rlim_t)megabytes << 20), RLIM_INFINITY);
   }
   signal(SIGXCPU, SIG_DFL);
   signal(SIGALRM, SIG_DFL);
   alarm((unsigned)wall_seconds);
}

/* How a child ended: its exit code, or 1000 + the number of the signal that ended it. */
int fuzz_wait(int child)
{
   int status;
   if (waitpid((pid_t)child, &status, 0) < 0) return -1;
   if (WIFEXITED(status)) return WEXITSTATUS(status);
   return 1000 + WTERMSIG(status);
}

/* End at once, without what a program does at its end. */
void fuzz_leave(int code)
{
   _exit(code);
}

/* Whole numbers, zero at first, that this process and its children share. */
int32_t *fuzz_share(int count)
{
   void *memory = mmap(NULL, (size_t)count * sizeof(int32_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
   return memory == MAP_FAILED ? NULL : (int32_t *)memory;
}

int fuzz_make_folder(const char *path)
{
   return mkdir(path, 0777);
}

int fuzz_enter(const char *path)
{
   return chdir(path);
}

/* Remove all files of a folder, and the folders in it. */
void fuzz_clear(const char *path)
{
   char name[4096];
   struct dirent *entry;
   DIR *folder = opendir(path);
   if (folder == NULL) return;
   while ((entry = readdir(folder)) != NULL) {
      if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0) continue;
      if ((size_t)snprintf(name, sizeof name, "%s/%s", path, entry->d_name) >= sizeof name) continue;
      if (entry->d_type == DT_DIR) {
         fuzz_clear(name);
         rmdir(name);
      } else {
         unlink(name);
      }
   }
   closedir(folder);
}

/* Processor time of all children that have ended [s]. */
double fuzz_children_seconds(void)
{
   struct rusage usage;
   getrusage(RUSAGE_CHILDREN, &usage);
   return (double)usage.ru_utime.tv_sec + 1e-6 * (double)usage.ru_utime.tv_usec + (double)usage.ru_stime.tv_sec +
          1e-6 * (double)usage.ru_stime.tv_usec;
}
