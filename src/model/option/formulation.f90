! SPDX-License-Identifier: MIT
!> The formulation of contacts that a run takes, and options that have no effect in it.
!>
!> The word of the user prevails, also over a preset: `preset` with formulation = 'length' has contacts by length with
!> the closing rule and the tolerances of the preset. Ties exist by length only: tie = .true. makes all contacts of the
!> run those by length; a preset without a word for the formulation contradicts it.
module rockdda_model_formulation
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_option_table, only : describe_options
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: choose_formulation, report_unused

   character(len=*), parameter :: by_length = 'length'

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

   !> Warn of numbers that have no effect with contacts of vertices on edges, where they were read.
   subroutine report_unused(options, messages)
      type(run_options_type), intent(in) :: options        !! as given
      type(diagnostics_type), intent(inout) :: messages
      type(option_rows_type) :: table
      type(run_options_type) :: given
      type(parameters_type) :: none
      integer :: i
      given = options
      call describe_options(table, given, none)
      do i = 1, table%n
         associate (row => table%rows(i))
            if (row%by_length .and. (is_set(row%given%number) .or. is_set(row%given%whole))) &
               call messages%add(severity%warning, row%name//" has no effect with formulation 'vertex': there a "// &
               'contact is one vertex, with a sharp corner, on an edge, and has the stiffness g0', row%origin)
         end associate
      end do
   end subroutine report_unused

end module rockdda_model_formulation
