! SPDX-License-Identifier: MIT
!> The numbers of a bolt of the options, and what is wrong with them.
module rockdda_model_bolt_numbers
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : is_given, lower_case, to_string
   use rockdda_model_geometry_input, only : bolt_type, is_spring
   use rockdda_model_options, only : is_set
   implicit none
   private
   public :: bolt_numbers_type, numbers_of_bolt, bolt_problem

   !> Elements in grout along a bolt where `element` is not given, and their largest number in stiff grout.
   integer, parameter :: usual_elements = 10, most_usual = 100
   !> More nodes are a slip of `element`.
   real(wp), parameter :: most_nodes = 10000
   real(wp), parameter :: pi = acos(-1.0_wp)
   character(len=*), parameter :: automatic = 'auto'

   !> What a bolt is made of: its forces and stiffnesses.
   type :: bolt_numbers_type
      real(wp) :: length = 0                      !! [length]
      logical :: grouted = .false.                !! else head and toe alone are held
      real(wp) :: axial = 0                       !! E A [force]
      real(wp) :: yield = huge(1.0_wp)            !! force
      real(wp) :: rupture_strain = huge(1.0_wp)   !! plastic strain at which an element breaks
      real(wp) :: stroke = huge(1.0_wp)           !! plastic elongation at which it breaks [length]
      real(wp) :: pretension = 0                  !! force
      real(wp) :: spacing = 1                     !! out of the plane [length]
      real(wp) :: element = 0                     !! largest distance of nodes in grout [length]
      real(wp) :: grout_stiffness = 0             !! [force/length^2]
      real(wp) :: grout_strength = 0              !! [force/length]
      real(wp) :: grout_residual = 1              !! share of the strength after slip
      real(wp) :: free(2) = 0                     !! part without grout, distances from the head [length]
      real(wp) :: plate_strength = 0              !! force, of a grouted bolt; 0: no plate
      real(wp) :: shear_stiffness = 0             !! [force/length]
      real(wp) :: shear_strength = huge(1.0_wp)   !! force
   end type bolt_numbers_type

contains

   !> The numbers of a bolt of some length.
   pure type(bolt_numbers_type) function numbers_of_bolt(bolt, length) result(numbers)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: length
      character(len=:), allocatable :: kind
      real(wp) :: given
      kind = kind_of(bolt)
      numbers%length = length
      numbers%grouted = kind == 'grouted' .or. kind == 'friction'
      numbers%axial = bolt%young*area_of(bolt)
      if (bolt%yield_force > 0 .and. kind /= 'friction') numbers%yield = bolt%yield_force
      if (kind == 'yielding') then
         numbers%yield = bolt%plateau_force
         numbers%stroke = bolt%stroke
      end if
      if (is_set(bolt%rupture_strain)) numbers%rupture_strain = bolt%rupture_strain
      numbers%pretension = bolt%pretension
      if (is_set(bolt%spacing_out_of_plane)) numbers%spacing = bolt%spacing_out_of_plane
      if (numbers%grouted) then
         numbers%grout_stiffness = bolt%grout_stiffness
         numbers%element = length/usual_elements
         ! forces fall by the factor e over sqrt(EA/k)
         if (numbers%grout_stiffness > 0) numbers%element = min(numbers%element, &
            max(length/most_usual, 0.5_wp*sqrt(numbers%axial/numbers%grout_stiffness)))
         if (is_set(bolt%element)) numbers%element = bolt%element
         numbers%grout_strength = bolt%grout_strength
         if (is_set(bolt%grout_residual)) numbers%grout_residual = bolt%grout_residual
         if (is_set(bolt%plate_strength)) numbers%plate_strength = bolt%plate_strength
         if (allocated(bolt%free_length)) numbers%free = bolt%free_length(1:2)
      end if
      if (is_given(bolt%shear_stiffness)) then
         numbers%shear_stiffness = winkler_stiffness(bolt)
         if (.not. is_automatic(bolt%shear_stiffness)) numbers%shear_stiffness = number_of(bolt%shear_stiffness)
      end if
      if (is_given(bolt%shear_strength)) then
         given = bolt%yield_force/sqrt(3.0_wp)
         if (.not. is_automatic(bolt%shear_strength)) given = number_of(bolt%shear_strength)
         if (given > 0) numbers%shear_strength = given
      end if
   end function numbers_of_bolt

   !> Kind in lower case.
   pure function kind_of(bolt) result(kind)
      type(bolt_type), intent(in) :: bolt
      character(len=:), allocatable :: kind
      kind = 'spring'
      if (is_given(bolt%kind)) kind = lower_case(trim(adjustl(bolt%kind)))
   end function kind_of

   !> Cross-section of the steel.
   pure real(wp) function area_of(bolt) result(area)
      type(bolt_type), intent(in) :: bolt
      area = bolt%area
      if (is_set(bolt%diameter)) area = 0.25_wp*pi*bolt%diameter**2
   end function area_of

   !> Stiffness of a dowel in a joint: two beams on elastic bedding, V/delta = k/(4 beta), beta = (k/(4 E I))^(1/4).
   pure real(wp) function winkler_stiffness(bolt) result(stiffness)
      type(bolt_type), intent(in) :: bolt
      real(wp) :: inertia, beta
      inertia = area_of(bolt)**2/(4*pi)
      beta = (bolt%bedding_stiffness/(4*bolt%young*inertia))**0.25_wp
      stiffness = bolt%bedding_stiffness/(4*beta)
   end function winkler_stiffness

   !> Does the text say that the number is computed?
   pure logical function is_automatic(text)
      character(len=*), intent(in) :: text
      is_automatic = lower_case(trim(adjustl(text))) == automatic
   end function is_automatic

   !> The number in a text; below zero: there is none.
   pure real(wp) function number_of(text) result(number)
      character(len=*), intent(in) :: text
      integer :: status
      read (text, *, iostat=status) number
      if (status /= 0) number = -1
      if (.not. abs(number) < huge(number)) number = -1
   end function number_of

   !> What is missing, contradicts, or cannot be, in words; empty: nothing.
   pure function bolt_problem(bolt) result(problem)
      type(bolt_type), intent(in) :: bolt
      character(len=:), allocatable :: problem, kind
      logical :: grouted, pattern
      kind = kind_of(bolt)
      grouted = kind == 'grouted' .or. kind == 'friction'
      pattern = allocated(bolt%along) .or. is_given(bolt%outline)
      problem = ''
      if (pattern) then
         if (is_spring(bolt)) call fail(problem, "a spring has ends 'from' and 'to', no pattern")
         if (allocated(bolt%from) .or. allocated(bolt%to)) call fail(problem, &
            "give 'from' and 'to', or a pattern, not both")
         if (allocated(bolt%along) .and. is_given(bolt%outline)) call fail(problem, &
            "give 'along' or 'outline', not both")
         if (.not. is_set(bolt%spacing)) call fail(problem, "a pattern needs 'spacing'")
         if (.not. is_set(bolt%length)) call fail(problem, "a pattern needs 'length'")
         if (allocated(bolt%along)) then
            if (size(bolt%along) < 4 .or. mod(size(bolt%along), 2) /= 0) &
               call fail(problem, "'along' needs x, y of two or more points")
         end if
      else
         if (.not. allocated(bolt%from)) call fail(problem, "'from' is missing")
         if (.not. allocated(bolt%to)) call fail(problem, "'to' is missing")
         if (len(problem) > 0) return
         if (all(abs(bolt%from - bolt%to) <= 0)) call fail(problem, "'from' and 'to' are the same point")
      end if
      if (is_spring(bolt)) then
         if (.not. is_set(bolt%stiffness)) call fail(problem, "'stiffness' is missing (a kind other than "// &
                                                     "'spring' has 'young' and 'diameter' instead)")
         if (is_set(bolt%young) .or. is_set(bolt%area) .or. is_set(bolt%diameter) .or. &
             is_given(bolt%shear_stiffness) .or. is_set(bolt%grout_stiffness) .or. is_set(bolt%rupture_strain) .or. &
                is_set(bolt%stroke) .or. &
             is_set(bolt%spacing_out_of_plane)) &
            call fail(problem, "a spring has 'stiffness', 'pretension' and 'yield_force' only; give another 'kind'")
         call check_pretension()
         return
      end if
      if (is_set(bolt%stiffness)) call fail(problem, &
         "'stiffness' is that of a spring; this kind has 'young' and 'diameter'")
      if (.not. is_set(bolt%young)) call fail(problem, "'young' is missing")
      if (is_set(bolt%area) .eqv. is_set(bolt%diameter)) call fail(problem, "give 'diameter' or 'area'")
      if (grouted) then
         if (.not. is_set(bolt%grout_stiffness)) call fail(problem, "'grout_stiffness' is missing")
         if (is_set(bolt%element)) then
            if (length_of() > most_nodes*bolt%element) call fail(problem, "'element' gives more than 10000 nodes")
         end if
         if (.not. is_set(bolt%grout_strength)) call fail(problem, "'grout_strength' is missing")
         if (allocated(bolt%free_length)) then
            if (bolt%free_length(1) < 0 .or. .not. bolt%free_length(2) > bolt%free_length(1)) then
               call fail(problem, "'free_length' must rise from 0 or more")
            end if
         end if
      else if (is_set(bolt%grout_stiffness) .or. is_set(bolt%grout_strength) .or. allocated(bolt%free_length)) then
         call fail(problem, "grout belongs to the kinds 'grouted' and 'friction'")
      end if
      if (bolt%pretension < 0 .and. .not. grouted) call fail(problem, &
         "'pretension' must be 0 or more: without grout this kind bears no compression")
      if (kind == 'friction' .and. bolt%yield_force > 0) call fail(problem, &
         "the steel of kind 'friction' does not yield")
      if (kind == 'yielding') then
         if (.not. is_set(bolt%plateau_force)) call fail(problem, "'plateau_force' is missing")
         if (.not. is_set(bolt%stroke)) call fail(problem, "'stroke' is missing")
         if (bolt%yield_force > 0) call fail(problem, "kind 'yielding' has 'plateau_force' instead of 'yield_force'")
      else if (is_set(bolt%plateau_force) .or. is_set(bolt%stroke)) then
         call fail(problem, "'plateau_force' and 'stroke' belong to kind 'yielding'")
      end if
      if (is_set(bolt%rupture_strain) .and. .not. (bolt%yield_force > 0 .or. kind == 'yielding')) &
         call fail(problem, "'rupture_strain' is that of the yielding steel: give 'yield_force'")
      if (is_given(bolt%shear_stiffness)) then
         if (is_automatic(bolt%shear_stiffness)) then
            if (.not. is_set(bolt%bedding_stiffness)) call fail(problem, &
         "shear_stiffness = 'auto' needs 'bedding_stiffness'")
         else if (number_of(bolt%shear_stiffness) < 0) then
            call fail(problem, "'shear_stiffness' must be 0 or more, or 'auto'")
         end if
      end if
      if (is_given(bolt%shear_strength)) then
         if (is_automatic(bolt%shear_strength)) then
            if (.not. bolt%yield_force > 0) call fail(problem, "shear_strength = 'auto' needs 'yield_force'")
         else if (number_of(bolt%shear_strength) < 0) then
            call fail(problem, "'shear_strength' must be 0 or more, or 'auto'")
         end if
      end if
      call check_pretension()
      if (grouted .and. is_set(bolt%plate_strength) .and. bolt%pretension > bolt%plate_strength) &
         call fail(problem, "'pretension' = "//to_string(bolt%pretension, 6)//" is larger than 'plate_strength' = "// &
                   to_string(bolt%plate_strength, 6))

   contains

      !> The pretension is no more than what the steel bears.
      pure subroutine check_pretension()
         if (abs(bolt%pretension) > limit_of_steel()) call fail(problem, "'pretension' = "// &
            to_string(bolt%pretension, 6)//' is larger than the force at which it yields, '// &
            trim(merge("'plateau_force'", "'yield_force'  ", kind == 'yielding'))//' = '// &
            to_string(limit_of_steel(), 6))
      end subroutine check_pretension

      !> Length of one bolt.
      pure real(wp) function length_of()
         length_of = 0
         if (is_set(bolt%length)) length_of = bolt%length
         if (allocated(bolt%from) .and. allocated(bolt%to)) length_of = norm2(bolt%to - bolt%from)
      end function length_of

      !> Yield force.
      pure real(wp) function limit_of_steel()
         limit_of_steel = huge(1.0_wp)
         if (bolt%yield_force > 0) limit_of_steel = bolt%yield_force
         if (kind == 'yielding') limit_of_steel = bolt%plateau_force
      end function limit_of_steel

      !> The first problem counts.
      pure subroutine fail(problem, text)
         character(len=:), allocatable, intent(inout) :: problem
         character(len=*), intent(in) :: text
         if (len(problem) == 0) problem = text
      end subroutine fail

   end function bolt_problem

end module rockdda_model_bolt_numbers
