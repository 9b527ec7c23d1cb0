! SPDX-License-Identifier: MIT
!> The formulation of contacts that a run takes, and options that have no effect in it.
!>
!> The word of the user prevails, also over a preset: `preset` with formulation = 'length' has contacts by length with
!> the closing rule and the tolerances of the preset. Ties exist by length only: tie = .true. makes all contacts of the
!> run those by length; a preset without a word for the formulation contradicts it.
module rockdda_model_formulation
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_option, only : option_visitor_type, option_type
   use rockdda_model_option_table, only : describe_options
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: choose_formulation, report_unused

   character(len=*), parameter :: by_length = 'length'
   !> What the table of options says of an option that has an effect by length only.
   character(len=*), parameter :: applies_by_length = 'formulation length'

   !> Finds numbers that are given and have an effect by length only.
   type, extends(option_visitor_type) :: unused_type
      type(diagnostics_type) :: messages
      character(len=:), allocatable :: found     !! name of such an option whose place is not known yet
      logical :: is_element = .false.            !! in an element of a list
      type(origin_type) :: place                 !! of the element
   contains
      procedure :: begin => begin_group
      procedure :: start_element => begin_element
      procedure :: add_real => find_real
      procedure :: add_integer => find_integer
      procedure :: locate => find_place
   end type unused_type

contains

   !> Settle the formulation: `settings` holds the options with their defaults.
   subroutine choose_formulation(options, has_preset, settings, messages)
      type(run_options_type), intent(in) :: options        !! as given
      logical, intent(in) :: has_preset
      type(run_options_type), intent(inout) :: settings
      type(diagnostics_type), intent(inout) :: messages
      type(joint_material_type) :: tied
      character(len=:), allocatable :: what
      logical :: is_given, has_tie
      is_given = .false.
      if (allocated(options%formulation)) is_given = len_trim(options%formulation) > 0
      if (settings%formulation == by_length) then
         if (has_preset .and. is_given) call messages%add(severity%note, "formulation 'length' is given: of the "// &
            "preset '"//options%preset//"' the closing rule, tolerances and defaults hold, its contacts do not", &
            options%formulation_origin)
         return
      end if
      call find_tie(settings, tied, has_tie)
      if (.not. has_tie) return
      what = 'joint material '//to_string(tied%number)//": tie = .true. needs formulation 'length'"
      if (has_preset) then
         call messages%add(severity%error, what//", and the preset '"//options%preset//"' has 'vertex': leave out "// &
                           "the tie or the preset, or give &contact formulation = 'length'", tied%origin)
      else if (is_given) then
         call messages%add(severity%warning, what//", which all contacts of the run take in place of 'vertex'", &
                           tied%origin)
      else
         call messages%add(severity%note, what//', which all contacts of the run take', tied%origin)
      end if
      settings%formulation = by_length
   end subroutine choose_formulation

   !> A group by which a material is tied, and that no later group takes back.
   subroutine find_tie(settings, tied, has_tie)
      type(run_options_type), intent(in) :: settings
      type(joint_material_type), intent(out) :: tied
      logical, intent(out) :: has_tie
      type(joint_material_type), allocatable :: groups(:)
      integer :: i, k
      allocate (groups(0))
      if (allocated(settings%joint_materials)) groups = [groups, settings%joint_materials]
      if (allocated(settings%joint_laws)) groups = [groups, settings%joint_laws]
      has_tie = .false.
      do i = 1, size(groups)
         if (.not. (groups(i)%tie_given .and. groups(i)%tie)) cycle
         if (any([(groups(k)%tie_given .and. groups(k)%number == groups(i)%number .and. .not. groups(k)%tie, &
                   k=i + 1, size(groups))])) cycle
         tied = groups(i)
         has_tie = .true.
         return
      end do
   end subroutine find_tie

   !> Warn of options that have no effect with contacts of vertices on edges, where they were read.
   subroutine report_unused(options, messages)
      type(run_options_type), intent(in) :: options        !! as given
      type(diagnostics_type), intent(inout) :: messages
      type(unused_type) :: unused
      type(run_options_type) :: given
      type(parameters_type) :: none
      given = options
      call describe_options(unused, given, none)
      call messages%append(unused%messages)
   end subroutine report_unused

   !> A group begins.
   subroutine begin_group(self, name, meaning, is_list)
      class(unused_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      logical, intent(in), optional :: is_list
      self%is_element = .false.
      self%found = ''
      associate (unused_1 => name, unused_2 => meaning, unused_3 => present(is_list))
      end associate
   end subroutine begin_group

   !> An element of a list begins.
   subroutine begin_element(self, i, origin)
      class(unused_type), intent(inout) :: self
      integer, intent(in) :: i
      type(origin_type), intent(inout) :: origin
      self%is_element = .true.
      self%place = origin
      associate (unused => i)
      end associate
   end subroutine begin_element

   !> A real.
   subroutine find_real(self, row, given, used, origin)
      class(unused_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given
      real(wp), intent(inout), optional :: used
      type(origin_type), intent(inout), optional :: origin
      call find_option(self, row, is_set(given))
      associate (unused_1 => present(used), unused_2 => present(origin))
      end associate
   end subroutine find_real

   !> A whole number.
   subroutine find_integer(self, row, given, used)
      class(unused_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(inout) :: given
      integer, intent(inout), optional :: used
      call find_option(self, row, is_set(given))
      associate (unused => present(used))
      end associate
   end subroutine find_integer

   !> An option: in an element of a list its place is that of the element, else `find_place` comes next.
   subroutine find_option(self, row, is_given)
      type(unused_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      logical, intent(in) :: is_given
      self%found = ''
      if (.not. is_given .or. row%applies /= applies_by_length) return
      self%found = row%name
      if (self%is_element) call find_place(self, self%place)
   end subroutine find_option

   !> Where the last option was read.
   subroutine find_place(self, origin)
      class(unused_type), intent(inout) :: self
      type(origin_type), intent(inout) :: origin
      if (len(self%found) > 0) call self%messages%add(severity%warning, self%found// &
         " has no effect with formulation 'vertex': there a contact is one vertex, with a sharp corner, on an "// &
         'edge, and has the stiffness g0', origin)
      self%found = ''
   end subroutine find_place

end module rockdda_model_formulation
