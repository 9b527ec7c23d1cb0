! SPDX-License-Identifier: MIT
!> What the command line or the Python call asks of a run.
module rockdda_run_request
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : run_options_type, unset_integer, unset_real, is_set, most_threads
   implicit none
   private
   public :: run_request_type, apply_request

   !> Options of the command line or of the Python call; they override the options file.
   type :: run_request_type
      character(len=:), allocatable :: output        !! '' when not given, and so below
      character(len=:), allocatable :: config
      character(len=:), allocatable :: solver
      integer :: dialect = 0                         !! one of dialect%...
      integer :: threads = unset_integer
      integer :: steps = unset_integer
      integer :: save_every = unset_integer
      real(wp) :: t_end = unset_real
      real(wp) :: max_wall = unset_real
      real(wp) :: checkpoint_every = unset_real
      logical :: allow_open = .false.                !! an outline that does not close is a warning
      logical :: strict = .false.                    !! an answer that is not to be trusted ends the run
      logical :: force = .false.                     !! overwrite an older result
   end type run_request_type

contains

   !> Override options of the file by those of the request.
   subroutine apply_request(request, options, messages)
      class(run_request_type), intent(in) :: request
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      if (is_set(request%threads)) options%threads = request%threads
      if (is_set(request%steps)) options%steps = request%steps
      if (is_set(request%t_end)) options%t_end = request%t_end
      if (is_set(request%max_wall)) options%max_wall = request%max_wall
      if (is_set(request%checkpoint_every)) options%checkpoint_every = request%checkpoint_every
      if (is_set(request%save_every)) then
         options%save_every = request%save_every
         options%save_dt = unset_real
      end if
      options%strict = options%strict .or. request%strict
      options%allow_open = options%allow_open .or. request%allow_open
      if (len(request%solver) > 0) options%method = request%solver
      if (len(request%output) > 0) options%output_file = request%output
      if (request%threads > most_threads) call messages%add(severity%error, 'threads: must be '// &
         to_string(most_threads)//' or less, found '//to_string(request%threads))
   end subroutine apply_request

end module rockdda_run_request
