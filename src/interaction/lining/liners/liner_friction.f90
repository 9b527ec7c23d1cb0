! SPDX-License-Identifier: MIT
!> Linings that slide on their joints: friction that agrees with the normal forces it causes, dashpots, impulses of ties
!> that close, and which of them do not settle.
module rockdda_interaction_liner_friction
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_block_names, only : block_name
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_dashpots, only : dashpot_coefficient
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_liner, only : liner_type, beam_links, on_segment, respond, largest_pressure
   use rockdda_interaction_liner_ties, only : tie_response_type, tie_state
   use rockdda_linear_anderson, only : anderson_type
   implicit none
   private
   public :: liner_friction_type, friction_agreement, set_dashpots, add_impulses_of, changes_of

   !> Friction forces, which wait for normal forces, agree with their laws to this share.
   real(wp), parameter :: friction_agreement = 1.0e-6_wp
   !> Within a round the misfit of friction and normal forces is brought down by this factor.
   real(wp), parameter :: reduction = 0.03_wp

   !> A search within a round.
   type :: liner_friction_type
      private
      integer, allocatable :: sliding(:, :)      !! (2, n) lining and tie of those that slide
      real(wp), allocatable :: friction(:), miss(:)   !! (n) [force]
      real(wp) :: goal = 0                       !! miss of friction that is small enough in the round
      type(anderson_type) :: acceleration
   contains
      procedure :: begin
      procedure :: improve
      procedure :: add
      procedure :: predict
   end type liner_friction_type

contains

   !> Begin a search, while all states stay as they are, for friction forces that agree with the normal forces that they
   !> cause: as for contacts (rockdda_interaction_friction_search).
   subroutine begin(self, liners)
      class(liner_friction_type), intent(inout) :: self
      type(liner_type), intent(in) :: liners(:)
      integer :: i, k, n, pass
      do pass = 1, 2
         n = 0
         do k = 1, size(liners)
            if (liners(k)%joint == 0 .or. .not. liners(k)%is_there) cycle
            do i = 1, size(liners(k)%ties)
               associate (tie => liners(k)%ties(i))
                  if (.not. (tie%acts .and. (tie%state == tie_state%slides .or. tie%state == tie_state%parts))) cycle
                  n = n + 1
                  if (pass == 2) self%sliding(:, n) = [k, i]
               end associate
            end do
         end do
         if (pass == 2) exit
         if (allocated(self%sliding)) deallocate (self%sliding, self%friction, self%miss)
         allocate (self%sliding(2, n), self%friction(n), self%miss(n))
      end do
      call self%acceleration%restart(n)
      self%goal = -1
   end subroutine begin

   !> Compare the friction forces of the last solve with the limits at its motion, and replace them by a better guess.
   !> It is enough when they miss the limits by far less than at first, or than a round accepts.
   subroutine improve(self, laws, to_end, liners, is_enough)
      class(liner_friction_type), intent(inout) :: self
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      logical, intent(in) :: to_end          !! as well as a round must be accepted
      type(liner_type), intent(inout) :: liners(:)
      logical, intent(out) :: is_enough
      type(tie_response_type) :: of_tie
      real(wp) :: worst, largest
      integer :: i, k, n
      is_enough = .true.
      n = 0
      if (allocated(self%sliding)) n = size(self%friction)
      if (n == 0) return
      worst = 0
      largest = 0
      do i = 1, n
         k = self%sliding(1, i)
         associate (tie => liners(k)%ties(self%sliding(2, i)))
            if (i == 1) then
               largest = largest_pressure(liners(k))
            else if (k /= self%sliding(1, i - 1)) then
               largest = largest_pressure(liners(k))
            end if
            call respond(laws, liners(k), tie, tie%motion + tie%move, of_tie)
            self%friction(i) = abs(tie%force(2))
            self%miss(i) = of_tie%limit - self%friction(i)
            worst = max(worst, abs(self%miss(i))/max(tiny(1.0_wp), self%friction(i), tie%length*largest))
         end associate
      end do
      if (self%goal < 0) self%goal = max(reduction*worst, 0.5_wp*friction_agreement)
      is_enough = worst <= merge(0.5_wp*friction_agreement, self%goal, to_end)
      if (is_enough) return
      call self%acceleration%next(self%friction, self%miss)
      do i = 1, n
         associate (tie => liners(self%sliding(1, i))%ties(self%sliding(2, i)))
            tie%force(2) = sign(max(0.0_wp, self%friction(i)), tie%force(2))
         end associate
      end do
   end subroutine improve

   !> The friction forces alone, where all states are those of the last solve.
   subroutine add(self, liners, equations)
      class(liner_friction_type), intent(in) :: self
      type(liner_type), intent(in) :: liners(:)
      type(equations_type), intent(inout) :: equations
      integer :: i, l
      if (.not. allocated(self%sliding)) return
      do i = 1, size(self%friction)
         associate (liner => liners(self%sliding(1, i)), tie => liners(self%sliding(1, i))% &
                    ties(self%sliding(2, i)))
            l = liner%first_link + beam_links*size(liner%joints) + self%sliding(2, i)
            call equations%set_link(l, equations%stiffness(:, l), [equations%force(1, l), -tie%factor*tie%force(2)])
         end associate
      end do
   end subroutine add

   !> Motion of the ties that slide, for new friction forces.
   subroutine predict(self, liners, equations)
      class(liner_friction_type), intent(in) :: self
      type(liner_type), intent(inout) :: liners(:)
      type(equations_type), intent(in) :: equations
      real(wp) :: motion(2)
      integer :: i
      if (.not. allocated(self%sliding)) return
      do i = 1, size(self%friction)
         associate (liner => liners(self%sliding(1, i)))
            call equations%link_motion(liner%first_link + beam_links*size(liner%joints) + self%sliding(2, i), motion)
            liner%ties(self%sliding(2, i))%move = liner%ties(self%sliding(2, i))%level*motion
         end associate
      end do
   end subroutine predict

   !> Impulses on the blocks by ties that have closed in the step.
   subroutine add_impulses_of(liners, level, equations, dt, impulse)
      type(liner_type), intent(in) :: liners(:)
      real(wp), intent(in) :: level          !! share of the step's motion up to where forces act
      type(equations_type), intent(in) :: equations
      real(wp), intent(in) :: dt                             !! step [time]
      real(wp), intent(inout), contiguous :: impulse(:, :)   !! (6, nb)
      integer :: c, i, k
      do k = 1, size(liners)
         associate (liner => liners(k))
            if (.not. liner%is_there) cycle
            c = liner%first_link + beam_links*size(liner%joints)
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  if (.not. tie%acts .or. tie%level <= level) cycle
                  call equations%add_link_force(c + i, -dt/tie%factor*equations%link_force(c + i), impulse)
               end associate
            end do
         end associate
      end do
   end subroutine add_impulses_of

   !> Dashpots of the ties with a joint in a dynamic step, as contacts have them (rockdda_interaction_dashpots):
   !> undamped, friction feeds the vibration of the normal forces on which it depends.
   subroutine set_dashpots(liners, laws, level, context, attempt)
      type(liner_type), intent(inout) :: liners(:)
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      real(wp), intent(in) :: level          !! share of the step's motion up to where forces act
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), allocatable :: stiffness(:, :), holds(:)
      real(wp) :: squared(2), ratio
      integer :: b, i, k, side
      if (.not. allocated(laws)) return
      allocate (stiffness(2, context%blocks%n_blocks), holds(context%blocks%n_blocks))
      stiffness = 0
      do k = 1, size(liners)
         do i = 1, size(liners(k)%ties)
            associate (tie => liners(k)%ties(i))
               tie%drag = 0
               if (.not. tie%acts) cycle
               stiffness(:, tie%a) = stiffness(:, tie%a) + liners(k)%stiffness*tie%length
               stiffness(:, tie%b) = stiffness(:, tie%b) + liners(k)%stiffness*tie%length
            end associate
         end do
      end do
      if (.not. attempt%scheme%is_dynamic .or. .not. level > 0) return
      call context%blocks%count_holds(holds, attempt%released, context%held)
      do k = 1, size(liners)
         associate (liner => liners(k))
            if (liner%joint == 0) cycle
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  ratio = laws(liner%joint)%damping_ratio
                  if (tie%sliding .and. .not. ratio > 0) ratio = context%parameters%sliding_damping
                  if (.not. ratio > 0) cycle
                  squared = 0
                  do side = 1, 2
                     b = merge(tie%a, tie%b, side == 1)
                     if (holds(b) > 1) cycle
                     squared = squared + stiffness(:, b)/context%state%mass(b)
                  end do
                  tie%drag = [(dashpot_coefficient(ratio, liner%stiffness(side)*tie%length, squared(side)), &
                               side=1, 2)]/(tie%level*attempt%dt)
               end associate
            end do
         end associate
      end do
   end subroutine set_dashpots

   !> Lines on the ties that changed their state most often in an attempt.
   function changes_of(liners, context, most) result(text)
      type(liner_type), intent(in) :: liners(:)
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: most              !! lines
      character(len=:), allocatable :: text
      character(len=9), parameter :: names(0:4) = [character(len=9) :: 'open', 'held', 'sliding', 'parting', 'parting']
      logical, allocatable :: told(:)
      integer :: i, k, n
      text = ''
      do k = 1, size(liners)
         associate (ties => liners(k)%ties)
            if (allocated(told)) deallocate (told)
            allocate (told(size(ties)), source=.false.)
            do n = 1, min(most, size(ties))
               i = maxloc(ties%changes, 1, .not. told)
               told(i) = .true.
               if (ties(i)%changes == 0) exit
               associate (point => on_segment(context, ties(i)%b, ties(i)%arm) + context%state%datum)
                  text = text//new_line('a')//'  the back of '// &
                         block_name(context%blocks, context%parameters, ties(i)%b)// &
                         ' at ('//to_string(point(1))//', '//to_string(point(2))//'): '// &
                         counted(ties(i)%changes, 'change')// &
                         ', now '//trim(names(ties(i)%state))
               end associate
            end do
         end associate
      end do
   end function changes_of

end module rockdda_interaction_liner_friction
