/* SPDX-License-Identifier: MIT */
/* The cores that this process may use, and how busy they are (Linux). */
#define _GNU_SOURCE
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#ifdef __linux__
/* Cores that a control group grants, a whole number from 1 on; `most` without a limit. */
static int granted(int most)
{
   char path[4200], line[4096], *end;
   double quota, period;
   FILE *file = fopen("/proc/self/cgroup", "r");
   line[0] = '\0';
   while (file && fgets(line, sizeof line, file) && strncmp(line, "0::", 3) != 0) line[0] = '\0';
   if (file) fclose(file);
   line[strcspn(line, "\n")] = '\0';
   /* version 2: the group and all above it */
   for (end = line + strlen(line); strncmp(line, "0::/", 4) == 0; *end = '\0') {
      snprintf(path, sizeof path, "/sys/fs/cgroup%s/cpu.max", line + 3);
      file = fopen(path, "r");
      if (file && fscanf(file, "%lf %lf", &quota, &period) == 2 && period > 0 && quota/period < most)
         most = (int)(quota/period + 0.5);
      if (file) fclose(file);
      end = strrchr(line + 3, '/');
      if (end == line + 3 && end[1] == '\0') break;
      if (end == line + 3) end++;
   }
   /* version 1 */
   file = fopen("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "r");
   quota = -1;
   if (file && fscanf(file, "%lf", &quota) != 1) quota = -1;
   if (file) fclose(file);
   file = quota > 0 ? fopen("/sys/fs/cgroup/cpu/cpu.cfs_period_us", "r") : NULL;
   if (file && fscanf(file, "%lf", &period) == 1 && period > 0 && quota/period < most) most = (int)(quota/period + 0.5);
   if (file) fclose(file);
   return most > 1 ? most : 1;
}
#endif

/* Number of cores that the process may use: its affinity and the quota of its control groups. */
int rockdda_cores_allowed(void)
{
#ifdef __linux__
   cpu_set_t set;
   if (sched_getaffinity(0, sizeof set, &set) == 0) return granted(CPU_COUNT(&set));
#endif
   return (int)sysconf(_SC_NPROCESSORS_ONLN);
}

/* Seconds that the allowed cores have been idle, processor time of this process, and the clock. 0, or -1: unknown. */
int rockdda_cores_times(double *idle, double *own, double *now)
{
#ifdef __linux__
   cpu_set_t set;
   struct rusage usage;
   struct timespec clock;
   char line[512];
   long long part[5];
   int core, found = 0;
   FILE *file;
   if (sched_getaffinity(0, sizeof set, &set) != 0) return -1;
   file = fopen("/proc/stat", "r");
   if (!file) return -1;
   *idle = 0;
   while (fgets(line, sizeof line, file) && strncmp(line, "cpu", 3) == 0) {
      /* user, nice, system, idle, waiting for a disk */
      if (sscanf(line, "cpu%d %lld %lld %lld %lld %lld", &core, part, part + 1, part + 2, part + 3, part + 4) != 6 ||
          core < 0 || core >= CPU_SETSIZE || !CPU_ISSET(core, &set))
         continue;
      *idle += (double)(part[3] + part[4])/(double)sysconf(_SC_CLK_TCK);
      found = 1;
   }
   fclose(file);
   getrusage(RUSAGE_SELF, &usage);
   clock_gettime(CLOCK_MONOTONIC, &clock);
   *own = (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
          1e-6*(double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
   *now = (double)clock.tv_sec + 1e-9*(double)clock.tv_nsec;
   return found ? 0 : -1;
#else
   (void)idle;
   (void)own;
   (void)now;
   return -1;
#endif
}

void rockdda_cores_sleep(double seconds)
{
   struct timespec wait;
   wait.tv_sec = (time_t)seconds;
   wait.tv_nsec = (long)(1e9*(seconds - (double)wait.tv_sec));
   nanosleep(&wait, NULL);
}
