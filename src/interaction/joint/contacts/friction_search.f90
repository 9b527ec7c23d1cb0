! SPDX-License-Identifier: MIT
!> The search for friction forces that agree with the normal forces they cause, while all states stay as they are:
!> Anderson acceleration of the friction forces of the contacts that slide (see linear/anderson.f90).
!>
!>     call search%forget()                       in each attempt at a step
!>     call search%begin(table, trial)            in each round
!>     call search%improve(…, trial, worst)       after each solve
!>     call search%assess(worst, …, is_enough)
!>     call search%take_used(trial)               in the end: the forces of the last solve
module rockdda_interaction_friction_search
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_linear_anderson, only : anderson_type
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_open_close, only : open_close_type
   use rockdda_interaction_joint_response, only : joint_settings_type
   implicit none
   private
   public :: friction_search_type

   !> Within a round the misfit of friction and normal forces is brought down by this factor.
   real(wp), parameter :: reduction = 0.03_wp
   !> Where one correction leaves no more than this share of the misfit, the last one is left to the next round, when
   !> there must be one.
   real(wp), parameter :: weak_answer = 0.3_wp

   type :: friction_search_type
      integer :: n = 0                      !! contacts that slide
      integer, allocatable :: rows(:)       !! (>= n) their rows
      real(wp) :: deepest = 0               !! largest normal force of the closed contacts, at the motion of `begin`
      type(anderson_type), private :: acceleration
      real(wp), allocatable, private :: value(:), miss(:), used(:)   !! (>= n) [force]
      integer, allocatable, private :: before(:)     !! (pieces + 1) contacts that slide in the pieces before each
      integer, private :: n_assessed = 0    !! in this round
      real(wp), private :: first = 0        !! misfit that this round began with [force]
      real(wp), private :: start = 0        !! the same, also of the round before [force]
      real(wp), private :: goal = 0         !! misfit that is small enough in this round [force]
      real(wp), private :: answer = 1       !! share of the misfit that a correction left, this attempt
      logical, private :: is_weak = .false. !! friction answers weakly
   contains
      procedure :: forget
      procedure :: begin
      procedure :: improve
      procedure :: assess
      procedure :: take_used
   end type friction_search_type

contains

   !> Nothing is known of how friction answers.
   pure subroutine forget(self)
      class(friction_search_type), intent(inout) :: self
      self%answer = 1
      self%start = huge(1.0_wp)
   end subroutine forget

   !> Begin with the states and forces of a trial as they are.
   subroutine begin(self, table, trial)
      class(friction_search_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      real(wp) :: deepest
      integer :: p, room
      room = size(trial%joint)
      if (allocated(self%rows)) then
         if (size(self%rows) < room) deallocate (self%rows, self%value, self%miss, self%used, self%before)
      end if
      if (.not. allocated(self%rows)) allocate (self%rows(room), self%value(room), self%miss(room), self%used(room), &
                                                self%before(n_pieces(room) + 1))
      self%before(1) = 0
      deepest = 0
      !$omp parallel do default(none) shared(self, table, trial) private(p) reduction(max:deepest) schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do p = 1, n_pieces(table%n)
         call look_through((p - 1)*piece + 1, min(p*piece, table%n), table, trial, self%before(p + 1), deepest)
      end do
      !$omp end parallel do
      self%deepest = deepest
      do p = 1, n_pieces(table%n)
         self%before(p + 1) = self%before(p) + self%before(p + 1)
         if (self%before(p + 1) > self%before(p)) &
            call list_sliding((p - 1)*piece + 1, min(p*piece, table%n), trial, self%rows(self%before(p) + 1:))
      end do
      self%n = self%before(n_pieces(table%n) + 1)
      call self%acceleration%restart(room)
      self%n_assessed = 0
   end subroutine begin

   !> Contacts that slide among some of the rows, and the largest normal force of the closed ones.
   pure subroutine look_through(first, last, table, trial, n, deepest)
      integer, intent(in) :: first, last
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      integer, intent(out) :: n
      real(wp), intent(inout) :: deepest              !! [force]
      integer :: c
      n = 0
      do c = first, last
         if (trial%joint(c)%state == contact_state%open) cycle
         if (trial%joint(c)%state == contact_state%sliding) n = n + 1
         if (trial%joint(c)%partly) then
            deepest = max(deepest, trial%spring_force(table, c))
         else
            deepest = max(deepest, abs(trial%spring_force(table, c)))
         end if
      end do
   end subroutine look_through

   !> Those that slide.
   pure subroutine list_sliding(first, last, trial, rows)
      integer, intent(in) :: first, last
      type(open_close_type), intent(in) :: trial
      integer, intent(inout) :: rows(:)
      integer :: c, n
      n = 0
      do c = first, last
         if (trial%joint(c)%state /= contact_state%sliding) cycle
         n = n + 1
         rows(n) = c
      end do
   end subroutine list_sliding

   !> Compare the friction forces of the last solve with the limits at its motion, before any state is judged, and
   !> replace them by a better guess for the same states. `worst` is the largest miss of a force used.
   pure subroutine improve(self, table, laws, settings, trial, worst)
      class(friction_search_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_settings_type), intent(in) :: settings
      type(open_close_type), intent(inout) :: trial
      real(wp), intent(out) :: worst                  !! [force]
      integer :: c, i, n
      n = self%n
      worst = 0
      do i = 1, n
         c = self%rows(i)
         self%value(i) = trial%joint(c)%friction
         self%used(i) = self%value(i)
         self%miss(i) = trial%friction_limit(table, laws, settings, c) - self%value(i)
         worst = max(worst, abs(self%miss(i)))
      end do
      if (.not. worst > 0) return
      call self%acceleration%next(self%value(1:n), self%miss(1:n))
      do i = 1, n
         trial%joint(self%rows(i))%friction = max(0.0_wp, self%value(i))
      end do
   end subroutine improve

   !> Is the misfit that `improve` has found small enough, or so small that the last correction may be left to the
   !> next round?
   pure subroutine assess(self, worst, small, may_leave, is_enough)
      class(friction_search_type), intent(inout) :: self
      real(wp), intent(in) :: worst         !! [force]
      real(wp), intent(in) :: small         !! misfit that the rounds accept [force]
      logical, intent(in) :: may_leave      !! a correction may be left to the next round
      logical, intent(out) :: is_enough
      self%n_assessed = self%n_assessed + 1
      if (self%n_assessed == 1) then
         self%goal = max(reduction*worst, 0.5_wp*small)
         self%is_weak = self%answer <= weak_answer .and. worst < self%start
         self%start = worst
         self%first = worst
      else if (self%n_assessed == 2) then
         self%answer = worst/self%first
         self%is_weak = self%answer <= weak_answer
      end if
      is_enough = worst <= self%goal .or. &
                  (self%is_weak .and. may_leave .and. worst > small .and. self%answer*worst <= self%goal)
   end subroutine assess

   !> Back to the friction forces that the last solve used.
   pure subroutine take_used(self, trial)
      class(friction_search_type), intent(in) :: self
      type(open_close_type), intent(inout) :: trial
      integer :: i
      do i = 1, self%n
         trial%joint(self%rows(i))%friction = self%used(i)
      end do
   end subroutine take_used

end module rockdda_interaction_friction_search
