/* SPDX-License-Identifier: MIT */
/* The viewer beside a run: another program that is started, and waited for at the end. */
#define _GNU_SOURCE
#include <errno.h>
#include <limits.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

/* Start NAME view PATH, found beside this program, or on the PATH. Its standard output is our standard error, which leaves
   ours to the summary. Returns its number, or -1. */
int rockdda_viewer_start(const char *name, const char *path)
{
   char own[PATH_MAX + 64];
   char *arguments[4];
   posix_spawn_file_actions_t actions;
   posix_spawnattr_t attributes;
   sigset_t all;
   pid_t child = -1;
   ssize_t n = readlink("/proc/self/exe", own, PATH_MAX);
   int failed = 1;
   arguments[0] = (char *)name;
   arguments[1] = (char *)"view";
   arguments[2] = (char *)path;
   arguments[3] = NULL;
   posix_spawn_file_actions_init(&actions);
   posix_spawn_file_actions_adddup2(&actions, 2, 1);
   posix_spawnattr_init(&attributes);
   sigfillset(&all);
   posix_spawnattr_setsigdefault(&attributes, &all);
   posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
   if (n > 0) {
      char *slash;
      own[n] = '\0';
      slash = strrchr(own, '/');
      if (slash && strlen(name) < 63) {
         strcpy(slash + 1, name);
         if (access(own, X_OK) == 0)
            failed = posix_spawn(&child, own, &actions, &attributes, arguments, environ);
      }
   }
   if (failed) failed = posix_spawnp(&child, name, &actions, &attributes, arguments, environ);
   posix_spawn_file_actions_destroy(&actions);
   posix_spawnattr_destroy(&attributes);
   return failed ? -1 : (int)child;
}

/* Wait until it has ended; signals to this program do not end the waiting. */
void rockdda_viewer_wait(int child)
{
   int status;
   while (waitpid((pid_t)child, &status, 0) < 0 && errno == EINTR) { }
}
