! SPDX-License-Identifier: MIT
!> Takes the values of options out of the groups of a namelist file: each row of the table of options collects its
!> entries from all groups of the name, or in a list from that of its element.
module rockdda_io_option_reader
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : place_text, severity
   use rockdda_model_option, only : option_type, option_kind, list_rule, choice, columns_of, in_bounds, n_choices, &
                                    name_length
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_option_table, only : all_options, describe_options
   use rockdda_model_options, only : run_options_type, unset_real, unset_integer, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_possible_values, only : known_values_type, bounds_of
   use rockdda_model_quake_options, only : find_format, form_of
   use rockdda_model_units, only : unit_system
   use rockdda_io_csv_table, only : read_csv_table
   use rockdda_io_name_hints, only : group_hint, name_hint
   use rockdda_io_namelist_parser, only : namelist_type, entry_type
   use rockdda_io_option_values, only : get_real, get_integer, get_logical, get_text, get_file, get_choice, get_reals, &
                                        get_integers, demand
   use rockdda_io_record_file, only : read_record
   implicit none
   private
   public :: read_options, want_groups, read_table

   !> Place of an entry.
   type :: cursor_type
      integer :: member = 1             !! group among those of the name
      integer :: entry = 0
      logical :: first = .true.         !! no entry found yet
   end type cursor_type

   type :: option_reader_type
      type(namelist_type), pointer :: namelist => null()
      integer, allocatable :: members(:)      !! groups of the present name
      integer, allocatable :: element(:)      !! those whose entries count now
      logical, allocatable :: known_group(:)
      integer, allocatable :: offset(:)       !! entries before each group
      logical, allocatable :: known_entry(:)
      character(len=:), allocatable :: group  !! name of the present one
      type(known_values_type) :: known        !! units of the numbers, and what they can be
   end type option_reader_type

   abstract interface
      !> A table with all that a file may hold.
      function known_table() result(table)
         import :: option_rows_type
         type(option_rows_type) :: table
      end function known_table
   end interface

   !> What stands in the geometry file, and not in the options.
   character(len=*), parameter :: geometry_words(11) = [character(len=14) :: 'block', 'blocks', &
                                                        'fixed', 'hole', 'hole_point', 'line', 'lines', 'loading', &
                                                        'material_line', 'measured', 'measured_point']

contains

   !> Read the options of a parsed file.
   subroutine read_options(namelist, options)
      type(namelist_type), intent(inout), target :: namelist
      type(run_options_type), intent(inout) :: options      !! without elements in its lists
      type(option_rows_type) :: table
      type(parameters_type) :: no_parameters
      call want_groups(table, namelist)
      call describe_options(table, options, no_parameters)
      call read_table(namelist, table, all_options, geometry_words)
      call describe_options(table, options, no_parameters)
   end subroutine read_options

   !> Let a table have an element for each group of a parsed file that is a list, before it is described.
   subroutine want_groups(table, namelist)
      type(option_rows_type), intent(inout) :: table
      type(namelist_type), intent(in) :: namelist
      integer :: i
      do i = 1, namelist%n
         call table%want(namelist%groups(i)%name, 1)
      end do
   end subroutine want_groups

   !> Read the rows of a table that is described; described again it gives the values to the variables.
   subroutine read_table(namelist, table, known, elsewhere)
      type(namelist_type), intent(inout), target :: namelist
      type(option_rows_type), intent(inout) :: table
      procedure(known_table) :: known
      character(len=*), intent(in), optional :: elsewhere(:)   !! groups that stand in the geometry file
      type(option_reader_type) :: reader
      integer :: i
      call start(reader, namelist)
      do i = 1, table%n
         call begin_row(reader, table, i)
         call read_row(reader, table, i)
      end do
      call report_unknown(reader, known, elsewhere)
      call table%give_back()
   end subroutine read_table

   !> Begin with a parsed file.
   subroutine start(self, namelist)
      type(option_reader_type), intent(inout) :: self
      type(namelist_type), intent(inout), target :: namelist
      integer :: i
      self%namelist => namelist
      self%group = ''
      allocate (self%members(0), self%element(0), self%known_group(namelist%n), self%offset(namelist%n + 1))
      self%known_group = .false.
      self%offset(1) = 0
      do i = 1, namelist%n
         self%offset(i + 1) = self%offset(i) + namelist%groups(i)%n
      end do
      allocate (self%known_entry(self%offset(namelist%n + 1)))
      self%known_entry = .false.
   end subroutine start

   !> Report groups and names that the table does not have.
   subroutine report_unknown(self, known, elsewhere)
      type(option_reader_type), intent(inout) :: self
      procedure(known_table) :: known
      character(len=*), intent(in), optional :: elsewhere(:)
      type(option_rows_type) :: table
      integer :: i, k
      if (all(self%known_group) .and. all(self%known_entry)) return
      table = known()
      do i = 1, self%namelist%n
         associate (group => self%namelist%groups(i))
            if (.not. self%known_group(i)) then
               call self%namelist%messages%add(severity%error, 'unknown group &'//group%name//group_hint(group%name, &
                                               table%group_names(), elsewhere), self%namelist%origin(group%place))
               cycle
            end if
            do k = 1, group%n
               if (self%known_entry(self%offset(i) + k)) cycle
               call self%namelist%messages%add(severity%error, "unknown name '"//group%entries(k)%name//"' in &"// &
                                               group%name//name_hint(group%entries(k)%name, group%name, &
                                               table%group_of_names(), table%names()), &
                                               self%namelist%origin(group%entries(k)%place))
            end do
         end associate
      end do
   end subroutine report_unknown

   !> Find the groups in which row i may stand, when it is the first one of its group or of an element.
   subroutine begin_row(self, table, i)
      type(option_reader_type), intent(inout) :: self
      type(option_rows_type), intent(inout) :: table
      integer, intent(in) :: i
      integer :: k
      associate (row => table%rows(i), name => table%groups(table%rows(i)%group)%name)
         if (table%is_beside(i, i - 1)) then
            if (row%element > 0) row%origin = table%rows(i - 1)%origin
            return
         end if
         call self%known%begin_group()
         if (self%group /= name) then
            self%group = trim(name)
            self%members = pack([(k, k=1, self%namelist%n)], &
                                [(self%namelist%groups(k)%name == name, k=1, self%namelist%n)])
            self%known_group(self%members) = .true.
            self%element = self%members
            if (name == 'model' .and. size(self%members) > 0) self%known%system = unit_system('SI')
         end if
         if (row%element == 0) return
         self%element = [self%members(row%element)]
         row%origin = self%namelist%origin(self%namelist%groups(self%element(1))%place)
      end associate
   end subroutine begin_row

   !> Read row i: all its entries, of which the last one counts.
   subroutine read_row(self, table, i)
      type(option_reader_type), intent(inout) :: self
      type(option_rows_type), intent(inout) :: table
      integer, intent(in) :: i
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      do while (next(self, table%rows(i), cursor, entry))
         call read_value(self, table, i, entry)
         if (table%rows(i)%element == 0) table%rows(i)%origin = self%namelist%origin(entry%place)
      end do
      if (cursor%first .and. len(table%rows(i)%default_from) > 0) &
         table%rows(i)%given = table%rows(table%find(i, table%rows(i)%default_from))%given
   end subroutine read_row

   !> Move to the next entry of this option; false when there is none. One that is missing, and one that is given
   !> again, are reported here.
   logical function next(self, row, cursor, entry)
      type(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      type(cursor_type), intent(inout) :: cursor
      type(entry_type), pointer, intent(out) :: entry  !! null when there is none
      type(cursor_type) :: before
      integer :: k, i
      entry => null()
      next = .true.
      before = cursor
      do i = cursor%member, size(self%element)
         associate (group => self%namelist%groups(self%element(i)))
            do k = cursor%entry + 1, group%n
               if (group%entries(k)%name /= row%name) cycle
               self%known_entry(self%offset(self%element(i)) + k) = .true.
               cursor = cursor_type(i, k, .false.)
               if (.not. (before%first .or. row%adds_up)) call report_again(self, row%name, before, cursor)
               entry => self%namelist%groups(self%element(i))%entries(k)
               return
            end do
            if (row%required .and. cursor%first) call self%namelist%messages%add(severity%error, '&'// &
               group%name//": '"//row%name//"' is missing", self%namelist%origin(group%place))
         end associate
         cursor%entry = 0
      end do
      next = .false.
   end function next

   !> Report an option that is given again, in the same group or in another one of its name.
   subroutine report_again(self, name, before, cursor)
      type(option_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(cursor_type), intent(in) :: before, cursor
      character(len=:), allocatable :: text
      text = ': given again in the same group, the last one counts'
      if (cursor%member > before%member) &
         text = ': given again in another &'//self%group//', the last one counts; before: '// &
                place_text(self%namelist%origin(place_of(before)))
      call self%namelist%messages%add(severity%warning, name//text, self%namelist%origin(place_of(cursor)))

   contains

      !> Where an entry stands.
      pure integer function place_of(at)
         type(cursor_type), intent(in) :: at
         place_of = self%namelist%groups(self%element(at%member))%entries(at%entry)%place
      end function place_of

   end subroutine report_again

   !> Read the value of row i.
   subroutine read_value(self, table, i, entry)
      type(option_reader_type), intent(inout) :: self
      type(option_rows_type), intent(inout) :: table
      integer, intent(in) :: i
      type(entry_type), intent(in) :: entry
      real(wp), allocatable :: values(:)
      character(len=:), allocatable :: path
      real(wp) :: number
      integer :: whole
      associate (row => table%rows(i), given => table%rows(i)%given, least => nint(max(table%rows(i)%least, &
                                                                                        -real(huge(1), wp))))
         select case (row%kind)
         case (option_kind%number)
            number = unset_real
            call get_real(self%namelist, entry, number)
            if (.not. is_set(number)) return
            call demand_bounds(self, row, entry, number)
            call demand_possible(self, row, entry, [number])
            given%number = number
         case (option_kind%whole)
            whole = unset_integer
            call get_integer(self%namelist, entry, least, whole)
            if (.not. is_set(whole)) return
            call demand_bounds(self, row, entry, real(whole, wp))
            given%whole = whole
         case (option_kind%logical)
            call get_logical(self%namelist, entry, given%flag)
            given%is_given = .true.
         case (option_kind%text)
            if (row%is_file) then
               call get_file(self%namelist, entry, given%text, path)
               if (allocated(path)) given%text = path
               return
            end if
            call get_text(self%namelist, entry, given%text, row%or_number, row%or_number .and. len(row%unit) > 0)
            if (row%not_blank .and. allocated(given%text)) &
               call demand(self%namelist, entry, len_trim(given%text) > 0, 'must not be empty')
         case (option_kind%choice)
            call get_choice(self%namelist, entry, words_of(row), given%text, row%old_choice, row%remark)
            if (self%group == 'model' .and. row%name == 'units' .and. allocated(given%text)) &
               self%known%system = unit_system(given%text)
         case (option_kind%numbers)
            call get_reals(self%namelist, entry, size(given%numbers), .false., values)
            if (.not. allocated(values)) return
            call demand_rule(self, row, entry, reshape(values, [size(values), 1]))
            call demand_possible(self, row, entry, values)
            call move_alloc(values, given%numbers)
         case (option_kind%list)
            call get_reals(self%namelist, entry, merge(2, 1, row%rule == list_rule%pair), &
                           row%rule /= list_rule%pair, given%numbers)
         case (option_kind%wholes)
            call get_integers(self%namelist, entry, least, given%wholes)
         case (option_kind%rows)
            call read_rows(self, row, entry, given%rows)
         case (option_kind%file)
            call read_rows_of_file(self, row, entry, given%text, given%rows)
         case (option_kind%record)
            call read_record_file(self, table, i, entry)
         end select
      end associate
   end subroutine read_value

   !> The words of a choice.
   pure function words_of(row) result(words)
      type(option_type), intent(in) :: row
      character(len=name_length) :: words(n_choices(row))
      integer :: i
      do i = 1, size(words)
         words(i) = choice(row, i)
      end do
   end function words_of

   !> Read rows of reals one after another.
   subroutine read_rows(self, row, entry, rows)
      type(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      type(entry_type), intent(in) :: entry
      real(wp), allocatable, intent(inout) :: rows(:, :)
      real(wp), allocatable :: values(:), new(:, :)
      integer :: m
      m = size(columns_of(row))
      if (row%rule == list_rule%or_constant .and. entry%n == m - 1) then
         call get_reals(self%namelist, entry, m - 1, .false., values)
         if (allocated(values)) values = [0.0_wp, values]
      else
         call get_reals(self%namelist, entry, m, .true., values)
      end if
      if (.not. allocated(values)) return
      new = reshape(values, [m, size(values)/m])
      call demand_rule(self, row, entry, new)
      call demand_possible(self, row, entry, values)
      if (row%adds_up .and. allocated(rows)) new = reshape([rows, new], [m, size(rows, 2) + size(new, 2)])
      call move_alloc(new, rows)
   end subroutine read_rows

   !> Read rows of reals in a file, beside the file of options.
   subroutine read_rows_of_file(self, row, entry, name, rows)
      type(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      type(entry_type), intent(in) :: entry
      character(len=:), allocatable, intent(inout) :: name  !! of the file
      real(wp), allocatable, intent(inout) :: rows(:, :)
      character(len=:), allocatable :: file, path
      call get_file(self%namelist, entry, file, path)
      if (allocated(file)) name = file
      if (allocated(path)) call read_csv_table(path, columns_of(row), rows, self%namelist%messages, &
                                               in_any_order=row%rule == list_rule%any_order)
   end subroutine read_rows_of_file

   !> Read the record of row i in a file, beside the file of options, as the options before it say.
   subroutine read_record_file(self, table, i, entry)
      type(option_reader_type), intent(inout) :: self
      type(option_rows_type), intent(inout) :: table
      integer, intent(in) :: i
      type(entry_type), intent(in) :: entry
      character(len=:), allocatable :: file, path
      character(len=:), allocatable :: form, column
      logical :: has_scale
      call get_file(self%namelist, entry, file, path)
      call find_format(table, i, form, column, has_scale)
      associate (given => table%rows(i)%given)
         if (allocated(file)) given%text = file
         if (allocated(path)) call read_record(path, form_of(form, file), column, has_scale, given%rows, given%number, &
                                               self%namelist%messages)
      end associate
   end subroutine read_record_file

   !> Report a value outside its bounds.
   subroutine demand_bounds(self, row, entry, value)
      type(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      type(entry_type), intent(in) :: entry
      real(wp), intent(in) :: value
      if (.not. in_bounds(row, value)) call demand(self%namelist, entry, .false., bounds_text(row))
   end subroutine demand_bounds

   !> Report a value that cannot be in the units of the file. Of several numbers with one unit the largest is judged.
   subroutine demand_possible(self, row, entry, values)
      type(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      type(entry_type), intent(in) :: entry
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: problem, judged_as
      integer :: i, k
      logical :: scaled, unlikely
      if (.not. self%known%system%is_known() .or. size(values) == 0) return
      k = maxloc(abs(values(1:min(row%n_in_unit, size(values)))), dim=1)
      if (values(k) < row%least .or. values(k) > row%most) return   ! reported as such
      scaled = .false.
      judged_as = self%group
      if (row%element > 0 .and. self%group /= 'water') then
         associate (group => self%namelist%groups(self%element(1)))
            scaled = any([(group%entries(i)%name == 'table', i=1, group%n)])
            do i = 1, group%n
               judged_as = bounds_of(judged_as, group%entries(i)%name)
            end do
         end associate
      end if
      call self%known%problem_of(judged_as, row%name, row%unit, values(k), scaled, problem, unlikely)
      if (len(problem) > 0) call self%namelist%messages%add(merge(severity%warning, severity%error, unlikely), &
         entry%name//': '//problem, self%namelist%origin(entry%values(min(k, entry%n))%place))
   end subroutine demand_possible

   !> "must be at least 0 and less than 90 degrees", and a remark.
   pure function bounds_text(row) result(text)
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      logical :: has_least, has_most
      has_least = row%least > -huge(1.0_wp)
      has_most = row%most < huge(1.0_wp)
      text = 'must be '
      if (has_least .and. .not. has_most .and. .not. row%above .and. abs(row%least) <= 0) then
         text = 'must not be negative'
      else
         if (has_least) text = text//trim(merge('greater than', 'at least    ', row%above))//' '//to_string(row%least)
         if (has_least .and. has_most) text = text//' and '
         if (has_most) text = text//trim(merge('less than', 'at most  ', row%below))//' '//to_string(row%most)
         if (row%unit == 'deg') text = text//' degrees'
      end if
      if (len(row%remark) > 0) text = text//' ('//row%remark//')'
   end function bounds_text

   !> Report numbers that break the rule of their list.
   subroutine demand_rule(self, row, entry, values)
      type(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      type(entry_type), intent(in) :: entry
      real(wp), intent(in) :: values(:, :)
      integer :: n, i
      n = size(values, 2)
      select case (row%rule)
      case (list_rule%two_points)
         call demand(self%namelist, entry, any(abs(values(1:2, 1) - values(3:4, 1)) > 0), 'the two ends must differ')
      case (list_rule%box)
         call demand(self%namelist, entry, all(values(1:2, 1) < values(3:4, 1)), 'must be xmin, ymin, xmax, ymax '// &
                     'with xmin < xmax and ymin < ymax')
      case (list_rule%rising, list_rule%or_constant)
         do i = 2, n
            if (values(1, i) >= values(1, i - 1)) cycle
            call demand(self%namelist, entry, .false., 'the times must not decrease', place=(i - 1)*size(values, 1) + 1)
            exit
         end do
      case (list_rule%frequency)
         do i = 1, n
            call demand(self%namelist, entry, values(3, i) >= 0, 'the frequency must not be negative', &
                        place=(i - 1)*size(values, 1) + 3)
         end do
      end select
   end subroutine demand_rule

end module rockdda_io_option_reader
