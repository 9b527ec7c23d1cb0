! SPDX-License-Identifier: MIT
!> What is known of the present stage by which it is found not to come to rest; a part of the state of a run.
module rockdda_stepping_stage_watch
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: progress_type, stage_watch_type

   !> A tenth of the steps allowed without progress ends the wait: its least unbalanced force is more than this share of
   !> the least one before, and the rest of the steps would not bring the model to rest either.
   integer, parameter :: parts = 10
   real(wp), parameter :: no_progress = 0.5_wp

   type :: progress_type
      integer :: steps = 0
      real(wp) :: least = huge(1.0_wp)          !! unbalanced force of this tenth of the steps; huge: it begins
      real(wp) :: least_before = huge(1.0_wp)   !! and of all before
   contains
      procedure :: stalls
   end type progress_type

   type :: stage_watch_type
      real(wp) :: grown = 0                     !! sum of the largest displacements of the steps [length]
      type(progress_type) :: progress           !! since loads and supports have changed
      real(wp) :: grown_before = 0              !! grown at the end of the last tenth [length]
      real(wp) :: grown_from = 0                !! grown when loads and supports last changed [length]
      real(wp) :: next_way = 0                  !! way from there at which to compare again; 0: not yet known [length]
      real(wp) :: least = huge(1.0_wp)          !! unbalanced force since then
      real(wp) :: least_at_mark = huge(1.0_wp)  !! the same at the last comparison; huge: there was none
      logical :: runs_away = .false.            !! no progress, and blocks have moved on
      integer :: marks = 0                      !! doublings of the way while a load rises; 0: none has risen
      real(wp) :: way = 0                       !! grown at the last of them [length]
      real(wp) :: times(3) = 0                  !! of the last three
      logical :: is_lost = .false.              !! the model does not follow the load
      real(wp) :: lost_share = 0                !! of the rise of the load in the stage and later with which it was lost
      real(wp) :: lost_time = 0                 !! time of the largest load that the model has carried
      integer :: restless = 0                   !! block that went on by forces that do not fall; 0: none
   end type stage_watch_type

contains

   !> Is it no use to go on, after one step more?
   logical function stalls(self, unbalanced, max_steps)
      class(progress_type), intent(inout) :: self
      real(wp), intent(in) :: unbalanced     !! at the end of the step
      integer, intent(in) :: max_steps       !! that are allowed
      stalls = .false.
      self%steps = self%steps + 1
      self%least = min(self%least, unbalanced)
      if (mod(self%steps, max(1, max_steps/parts)) /= 0) return
      stalls = self%least > no_progress*self%least_before
      self%least_before = min(self%least, self%least_before)
      self%least = huge(1.0_wp)
   end function stalls

end module rockdda_stepping_stage_watch
