/* SPDX-License-Identifier: MIT */
/* One thread at a time may use HDF5, which keeps state of its own: the turn of a thread. Used by rockdda_run_turn. */
#include <pthread.h>

static pthread_mutex_t turn = PTHREAD_MUTEX_INITIALIZER;

void rockdda_run_take_turn(void)
{
   pthread_mutex_lock(&turn);
}

void rockdda_run_end_turn(void)
{
   pthread_mutex_unlock(&turn);
}
