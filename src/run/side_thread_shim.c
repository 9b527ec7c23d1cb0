/* SPDX-License-Identifier: MIT */
/* A thread that does one piece of work beside the caller. Used by rockdda_run_step_loop. */
#define _GNU_SOURCE
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>

/* Stack for the work: local arrays of the Fortran code. */
static const size_t stack_size = 16 << 20;

typedef struct {
   pthread_t thread;
   void (*work)(void *);
   void *argument;
} side_thread_t;

static void *run(void *side)
{
   side_thread_t *self = side;
   self->work(self->argument);
   return NULL;
}

/* Begin work(argument) in a new thread, which receives no signals. NULL: there is none to be had. */
void *rockdda_run_begin_beside(void (*work)(void *), void *argument)
{
   side_thread_t *self = malloc(sizeof *self);
   pthread_attr_t attributes;
   sigset_t all, before;
   int status;
   if (!self) return NULL;
   self->work = work;
   self->argument = argument;
   if (pthread_attr_init(&attributes) != 0) {
      free(self);
      return NULL;
   }
   pthread_attr_setstacksize(&attributes, stack_size);
   sigfillset(&all);
   pthread_sigmask(SIG_SETMASK, &all, &before);
   status = pthread_create(&self->thread, &attributes, run, self);
   pthread_sigmask(SIG_SETMASK, &before, NULL);
   pthread_attr_destroy(&attributes);
   if (status == 0) return self;
   free(self);
   return NULL;
}

/* Wait for the end of the work. */
void rockdda_run_end_beside(void *side)
{
   side_thread_t *self = side;
   pthread_join(self->thread, NULL);
   free(self);
}
