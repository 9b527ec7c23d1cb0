! SPDX-License-Identifier: MIT
!> Rows of the table of options for records of ground acceleration: &quake; and what they must fulfil.
module rockdda_model_quake_options
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : lower_case, to_string
   use rockdda_model_options, only : quake_type, is_set
   use rockdda_model_option, only : option
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_units, only : unit_system_type, unit_system
   implicit none
   private
   public :: describe_quakes, settle_quakes, find_format, form_of, acts_as

contains

   !> &quake.
   subroutine describe_quakes(table, quakes)
      type(option_rows_type), intent(inout) :: table
      type(quake_type), allocatable, intent(inout) :: quakes(:)
      integer :: i
      call table%begin_list('quake', 'A record of ground acceleration in one direction. Several groups add up.')
      if (.not. allocated(quakes)) allocate (quakes(table%n_wanted()))
      do i = 1, size(quakes)
         call table%start_element(i, quakes(i)%origin)
         call describe_quake(table, quakes(i))
      end do
   end subroutine describe_quakes

   !> One group. The record comes last: how it is read depends on the options before it.
   subroutine describe_quake(table, quake)
      type(option_rows_type), intent(inout) :: table
      type(quake_type), intent(inout) :: quake
      character(len=*), parameter :: page = 'user-guide.md#earthquakes'
      call table%add(option('format', 'csv: a row of numbers for each time, the time first; at2: PEER, '// &
                            'equal steps', choices='at2|csv', &
                            default_text="at2 where the file's name ends in .at2, else csv"), quake%form)
      call table%add(option('column', 'name (in the header) or number of the column of the accelerations', &
                            applies='format csv', default_text='2', or_number=.true.), quake%column)
      call table%add(option('scale', 'factor of the values of the file, also of their unit', &
                            default_text='from the unit that the file names to that of the model (g: 9.81 in '// &
                            'metres and seconds), else 1'), quake%scale)
      call table%add(option('direction', 'direction of the motion', choices='x|y', default_word='x'), quake%direction)
      call table%add(option('apply', 'base_acceleration: the load -m a on all blocks, whose motion is then that '// &
                            'relative to the base; base_motion: fixed points and boundaries that hold move by '// &
                            'the displacement of the record; viscous_base: a wave that comes in at viscous '// &
                            'boundaries which face down (where none does: at all), with this acceleration', &
                            choices='base_acceleration|base_motion|viscous_base', default_word='base_acceleration', &
                            see=page), quake%apply)
      call table%add_record(option('record', 'file of the record', columns='t, a', required=.true., see=page), &
                            quake%rows, quake%file, quake%unit)
   end subroutine describe_quake

   !> Is the record applied in this way?
   pure logical function acts_as(quake, apply)
      type(quake_type), intent(in) :: quake
      character(len=*), intent(in) :: apply
      acts_as = apply == 'base_acceleration'
      if (.not. allocated(quake%apply)) return
      if (len_trim(quake%apply) > 0) acts_as = quake%apply == apply
   end function acts_as

   !> Format and factor of all records.
   subroutine settle_quakes(quakes, units, has_quiet, messages)
      type(quake_type), intent(inout) :: quakes(:)
      character(len=*), intent(in) :: units    !! system of units of the model
      logical, intent(in) :: has_quiet         !! there are viscous boundaries
      type(diagnostics_type), intent(inout) :: messages
      type(unit_system_type) :: system
      character(len=:), allocatable :: unit
      integer :: i
      system = unit_system(trim(units))
      do i = 1, size(quakes)
         associate (quake => quakes(i), title => '&quake '//to_string(i))
            if (allocated(quake%file)) quake%form = form_of(quake%form, quake%file)
            if (quake%form == 'at2') then
               if (len(quake%column) > 0) call messages%add(severity%error, title//": column belongs to format "// &
                  "'csv': a file of PEER has one component", quake%origin)
            end if
            if (acts_as(quake, 'viscous_base') .and. .not. has_quiet) call messages%add(severity%error, title// &
               ": apply = 'viscous_base' needs a &boundary of kind 'viscous'", quake%origin)
            if (quake%unit > 0 .and. .not. is_set(quake%scale)) then
               quake%scale = quake%unit/system%in_si(1.0_wp, 'length/time^2')
               if (system%is_known()) then
                  call messages%add(severity%note, title//': the record is in units of '//to_string(quake%unit)// &
                                    ' m/s2: it is multiplied by '//to_string(quake%scale)//' to be in '// &
                                    system%unit_of('length/time^2'), quake%origin)
                  cycle
               end if
               call messages%add(severity%note, title//': the record is in units of '//to_string(quake%unit)// &
                                 ' m/s2, by which it is multiplied (give scale where the model is not in metres '// &
                                 'and seconds)', quake%origin)
            end if
            if (is_set(quake%scale)) cycle
            quake%scale = 1
            if (.not. allocated(quake%file)) cycle
            unit = "the model's units"
            if (system%is_known()) unit = system%unit_of('length/time^2')
            call messages%add(severity%note, title//': the record names no unit: its values are taken as in '//unit// &
                              " (a header such as 't [s], a [g]' names it, scale replaces it)", quake%origin)
         end associate
      end do
   end subroutine settle_quakes

   !> How the record of row i is read, by the options before it.
   pure subroutine find_format(table, i, form, column, has_scale)
      type(option_rows_type), intent(in) :: table
      integer, intent(in) :: i
      character(len=:), allocatable, intent(out) :: form, column   !! empty: not given
      logical, intent(out) :: has_scale                            !! a factor of the values is given
      form = text_of('format')
      column = text_of('column')
      has_scale = is_set(table%rows(table%find(i, 'scale'))%given%number)

   contains

      !> The text of an option.
      pure function text_of(name) result(text)
         character(len=*), intent(in) :: name
         character(len=:), allocatable :: text
         text = ''
         associate (given => table%rows(table%find(i, name))%given)
            if (allocated(given%text)) text = trim(adjustl(given%text))
         end associate
      end function text_of

   end subroutine find_format

   !> The format that is given, or that of the name of the file.
   pure function form_of(given, file) result(form)
      character(len=*), intent(in) :: given    !! empty: not given
      character(len=*), intent(in) :: file
      character(len=:), allocatable :: form
      form = trim(given)
      if (len(form) > 0) return
      form = 'csv'
      if (len_trim(file) < 4) return
      if (lower_case(file(len_trim(file) - 3:len_trim(file))) == '.at2') form = 'at2'
   end function form_of

end module rockdda_model_quake_options
