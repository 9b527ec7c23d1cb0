/* SPDX-License-Identifier: MIT */
/* Lock for HDF5, whose state is global: one thread at a time may use it. Used by rockdda_run_hdf5_lock. */
#include <pthread.h>

static pthread_mutex_t hdf5_lock = PTHREAD_MUTEX_INITIALIZER;

void rockdda_run_lock_hdf5(void)
{
   pthread_mutex_lock(&hdf5_lock);
}

void rockdda_run_unlock_hdf5(void)
{
   pthread_mutex_unlock(&hdf5_lock);
}
