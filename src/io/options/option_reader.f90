! SPDX-License-Identifier: MIT
!> Takes the values of options out of the groups of a namelist file, as the table of options describes them. The table
!> is gone through once; each of its rows collects its entries from all groups of the name.
module rockdda_io_option_reader
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_model_option, only : option_visitor_type, option_type, list_rule, choice, n_choices
   use rockdda_model_options, only : unset_real, unset_integer, is_set
   use rockdda_model_possible_values, only : known_values_type
   use rockdda_model_quake_options, only : form_of
   use rockdda_model_units, only : unit_system
   use rockdda_io_csv_table, only : read_csv_table
   use rockdda_io_name_hints, only : group_hint, name_hint, name_length
   use rockdda_io_namelist_parser, only : namelist_type, entry_type
   use rockdda_io_option_list, only : option_list_type, list_options
   use rockdda_io_option_values, only : get_real, get_integer, get_logical, get_text, get_file, get_choice, get_reals, &
                                        get_integers, demand
   use rockdda_io_record_file, only : read_record
   implicit none
   private
   public :: option_reader_type

   !> Place of an entry.
   type :: cursor_type
      integer :: member = 1             !! group among those of the name
      integer :: entry = 0
      logical :: first = .true.         !! no entry found yet
   end type cursor_type

   type, extends(option_visitor_type) :: option_reader_type
      type(namelist_type), pointer :: namelist => null()
      type(diagnostics_type) :: messages
      integer, allocatable, private :: members(:)      !! groups of the present name
      integer, allocatable, private :: element(:)      !! those whose entries count now
      logical, allocatable, private :: known_group(:)
      integer, allocatable, private :: offset(:)       !! entries before each group
      logical, allocatable, private :: known_entry(:)
      integer, private :: found(2) = 0                 !! group and entry of the last row visited, 0: not given
      character(len=:), allocatable, private :: group  !! name of the present one
      type(known_values_type), private :: known        !! units of the numbers, and what they can be
   contains
      procedure :: start
      procedure :: report_unknown
      procedure :: begin => read_begin
      procedure :: resize => read_resize
      procedure :: start_element => read_element
      procedure :: add_real => read_real
      procedure :: add_integer => read_integer
      procedure :: add_logical => read_logical
      procedure :: add_text => read_text
      procedure :: add_choice => read_choice
      procedure :: add_reals => read_reals
      procedure :: add_list => read_list
      procedure :: add_integers => read_integers
      procedure :: add_rows => read_rows
      procedure :: add_file => read_file
      procedure :: add_record => read_record_file
      procedure :: locate => read_locate
      procedure, private :: next
      procedure, private :: demand_bounds
      procedure, private :: demand_possible
   end type option_reader_type

   !> What stands in the geometry file, and not in the options.
   character(len=*), parameter :: geometry_words(13) = [character(len=14) :: 'block', 'blocks', 'bolt', 'bolts', &
                                                        'fixed', 'hole', 'hole_point', 'line', 'lines', 'loading', &
                                                        'material_line', 'measured', 'measured_point']

contains

   !> Begin with a parsed file, which must outlive the reader.
   subroutine start(self, namelist)
      class(option_reader_type), intent(inout) :: self
      type(namelist_type), intent(in), target :: namelist
      integer :: i
      self%namelist => namelist
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
   subroutine report_unknown(self)
      class(option_reader_type), intent(inout) :: self
      type(option_list_type), allocatable :: list
      integer :: i, k
      if (all(self%known_group) .and. all(self%known_entry)) return
      allocate (list)
      call list_options(list)
      do i = 1, self%namelist%n
         associate (group => self%namelist%groups(i))
            if (.not. self%known_group(i)) then
               call self%messages%add(severity%error, 'unknown group &'//group%name// &
                                      group_hint(group%name, list%groups(:list%n_groups)%name, geometry_words), &
                                      self%namelist%origin(group%place))
               cycle
            end if
            do k = 1, group%n
               if (self%known_entry(self%offset(i) + k)) cycle
               call self%messages%add(severity%error, "unknown name '"//group%entries(k)%name//"' in &"// &
                  group%name//name_hint(group%entries(k)%name, group%name, list%group_of(:list%n), &
                                        list%names(:list%n)), self%namelist%origin(group%entries(k)%place))
            end do
         end associate
      end do
   end subroutine report_unknown

   !> Find the groups of this name.
   subroutine read_begin(self, name, meaning, is_list)
      class(option_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      logical, intent(in), optional :: is_list
      integer :: i
      self%group = name
      call self%known%begin_group()
      self%members = pack([(i, i=1, self%namelist%n)], [(self%namelist%groups(i)%name == name, i=1, self%namelist%n)])
      self%known_group(self%members) = .true.
      self%element = self%members
      if (name == 'model' .and. size(self%members) > 0) self%known%system = unit_system('SI')
      associate (unused_1 => meaning, unused_2 => present(is_list))
      end associate
   end subroutine read_begin

   !> Give the list an element for each group.
   subroutine read_resize(self, n)
      class(option_reader_type), intent(inout) :: self
      integer, intent(inout) :: n
      n = size(self%members)
   end subroutine read_resize

   !> Restrict the entries to those of group i of this name.
   subroutine read_element(self, i, origin)
      class(option_reader_type), intent(inout) :: self
      integer, intent(in) :: i
      type(origin_type), intent(inout) :: origin
      self%element = [self%members(i)]
      call self%known%begin_group()
      origin = self%namelist%origin(self%namelist%groups(self%members(i))%place)
   end subroutine read_element

   !> Move to the next entry of this option; false when there is none. One that is missing, and one that is given
   !> again in the same group, are reported here.
   logical function next(self, row, cursor, entry)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      type(cursor_type), intent(inout) :: cursor
      type(entry_type), pointer, intent(out) :: entry  !! null when there is none
      integer :: k, i
      entry => null()
      next = .true.
      if (cursor%first) self%found = 0
      do i = cursor%member, size(self%element)
         associate (group => self%namelist%groups(self%element(i)))
            do k = cursor%entry + 1, group%n
               if (group%entries(k)%name /= row%name) cycle
               if (cursor%entry > 0 .and. .not. row%adds_up) call self%messages%add(severity%warning, row%name// &
                  ': given again in the same group, the last one counts', self%namelist%origin(group%entries(k)%place))
               self%known_entry(self%offset(self%element(i)) + k) = .true.
               cursor = cursor_type(i, k, .false.)
               self%found = [self%element(i), k]
               entry => self%namelist%groups(self%element(i))%entries(k)
               return
            end do
            if (row%required .and. cursor%first) call self%messages%add(severity%error, '&'//group%name//": '"// &
               row%name//"' is missing", self%namelist%origin(group%place))
         end associate
         cursor%entry = 0
      end do
      next = .false.
   end function next

   !> Where the row before was read.
   subroutine read_locate(self, origin)
      class(option_reader_type), intent(inout) :: self
      type(origin_type), intent(inout) :: origin
      if (self%found(1) > 0) origin = self%namelist%origin( &
         self%namelist%groups(self%found(1))%entries(self%found(2))%place)
   end subroutine read_locate

   !> Read a real.
   subroutine read_real(self, row, given, used, origin)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given
      real(wp), intent(inout), optional :: used
      type(origin_type), intent(inout), optional :: origin
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      real(wp) :: found
      do while (self%next(row, cursor, entry))
         found = unset_real
         call get_real(self%namelist, entry, found, self%messages)
         if (.not. is_set(found)) cycle
         call self%demand_bounds(row, entry, found)
         call self%demand_possible(row, entry, [found])
         given = found
         if (present(origin)) origin = self%namelist%origin(entry%place)
      end do
      associate (unused => present(used))
      end associate
   end subroutine read_real

   !> Read a whole number.
   subroutine read_integer(self, row, given, used)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(inout) :: given
      integer, intent(inout), optional :: used
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      integer :: found
      do while (self%next(row, cursor, entry))
         found = unset_integer
         call get_integer(self%namelist, entry, nint(max(row%least, -real(huge(1), wp))), found, self%messages)
         if (.not. is_set(found)) cycle
         call self%demand_bounds(row, entry, real(found, wp))
         given = found
      end do
      associate (unused => present(used))
      end associate
   end subroutine read_integer

   !> .true. or .false.
   subroutine read_logical(self, row, given, used, is_given)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      logical, intent(inout) :: given
      logical, intent(inout), optional :: used
      logical, intent(inout), optional :: is_given
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      do while (self%next(row, cursor, entry))
         call get_logical(self%namelist, entry, given, self%messages)
         if (present(is_given)) is_given = .true.
      end do
      associate (unused => present(used))
      end associate
   end subroutine read_logical

   !> Read a text, or one of several words.
   subroutine read_text(self, row, given, used)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      character(len=:), allocatable, intent(inout), optional :: used
      call read_word(self, row, given)
      associate (unused => present(used))
      end associate
   end subroutine read_text

   !> Read one of several words.
   subroutine read_choice(self, row, given, used, true_for)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      logical, intent(inout) :: used
      integer, intent(in) :: true_for
      call read_word(self, row, given)
      associate (unused_1 => used, unused_2 => true_for)
      end associate
   end subroutine read_choice

   !> Read a text; where there are choices one of these.
   subroutine read_word(self, row, given)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      character(len=name_length) :: words(n_choices(row))
      integer :: i
      do i = 1, size(words)
         words(i) = choice(row, i)
      end do
      do while (self%next(row, cursor, entry))
         if (size(words) == 0) then
            call get_text(self%namelist, entry, given, self%messages, row%or_number)
            if (row%not_blank .and. allocated(given)) &
               call demand(self%namelist, entry, len_trim(given) > 0, 'must not be empty', self%messages)
         else
            call get_choice(self%namelist, entry, words, given, self%messages, row%old_choice, row%remark)
            if (self%group == 'model' .and. row%name == 'units' .and. allocated(given)) &
               self%known%system = unit_system(given)
         end if
      end do
   end subroutine read_word

   !> Read a fixed number of reals.
   subroutine read_reals(self, row, given, otherwise)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given(:)
      real(wp), intent(in), optional :: otherwise(:)
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      real(wp), allocatable :: values(:)
      do while (self%next(row, cursor, entry))
         call get_reals(self%namelist, entry, size(given), .false., values, self%messages)
         if (.not. allocated(values)) cycle
         given = values
         call demand_rule(self, row, entry, reshape(values, [size(values), 1]))
         call self%demand_possible(row, entry, values)
      end do
      if (cursor%first .and. present(otherwise)) given = otherwise
   end subroutine read_reals

   !> Read any number of reals.
   subroutine read_list(self, row, given)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:)
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      do while (self%next(row, cursor, entry))
         call get_reals(self%namelist, entry, 1, .true., given, self%messages)
      end do
   end subroutine read_list

   !> Read any number of whole numbers.
   subroutine read_integers(self, row, given)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, allocatable, intent(inout) :: given(:)
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      do while (self%next(row, cursor, entry))
         call get_integers(self%namelist, entry, nint(max(row%least, -real(huge(1), wp))), given, self%messages)
      end do
   end subroutine read_integers

   !> Read rows of reals one after another.
   subroutine read_rows(self, row, given, used)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :)
      real(wp), allocatable, intent(inout), optional :: used(:, :)
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      real(wp), allocatable :: values(:), all_rows(:, :)
      integer :: n, m
      m = count([(row%columns(n:n) == ',', n=1, len(row%columns))]) + 1
      do while (self%next(row, cursor, entry))
         if (row%rule == list_rule%or_constant .and. entry%n == m - 1) then
            call get_reals(self%namelist, entry, m - 1, .false., values, self%messages)
            if (allocated(values)) values = [0.0_wp, values]
         else
            call get_reals(self%namelist, entry, m, .true., values, self%messages)
         end if
         if (.not. allocated(values)) cycle
         n = 0
         if (row%adds_up .and. allocated(given)) n = size(given, 2)
         allocate (all_rows(m, n + size(values)/m))
         if (n > 0) all_rows(:, 1:n) = given
         all_rows(:, n + 1:) = reshape(values, [m, size(values)/m])
         call demand_rule(self, row, entry, all_rows(:, n + 1:))
         call self%demand_possible(row, entry, values)
         call move_alloc(all_rows, given)
      end do
      associate (unused => present(used))
      end associate
   end subroutine read_rows

   !> Read rows of reals in a file, beside the file of options.
   subroutine read_file(self, row, given, used, name)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :), used(:, :)
      character(len=:), allocatable, intent(inout), optional :: name  !! of the file
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      character(len=:), allocatable :: file, path
      do while (self%next(row, cursor, entry))
         call get_file(self%namelist, entry, file, path, self%messages)
         if (allocated(file) .and. present(name)) name = file
         if (.not. allocated(path)) cycle
         call read_csv_table(path, column_names(row), given, self%messages, &
                             in_any_order=row%rule == list_rule%any_order)
      end do
      associate (unused => allocated(used))
      end associate
   end subroutine read_file

   !> Read a record in a file, beside the file of options.
   subroutine read_record_file(self, row, given, used, name, has_scale, unit)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :), used(:, :)
      character(len=:), allocatable, intent(inout) :: name            !! of the file
      logical, intent(in) :: has_scale                                !! a factor of the values is given
      real(wp), intent(inout) :: unit                                 !! of the values [m/s^2], 0: not named
      type(cursor_type) :: cursor
      type(entry_type), pointer :: entry
      character(len=:), allocatable :: file, path
      do while (self%next(row, cursor, entry))
         call get_file(self%namelist, entry, file, path, self%messages)
         if (allocated(file)) name = file
         if (allocated(path)) call read_record(path, form_of(row%form, file), row%column, has_scale, given, unit, &
                                               self%messages)
      end do
      associate (unused => allocated(used))
      end associate
   end subroutine read_record_file

   !> The names of the columns of a row.
   pure function column_names(row) result(names)
      type(option_type), intent(in) :: row
      character(len=name_length), allocatable :: names(:)
      integer :: at, comma, i
      allocate (names(count([(row%columns(i:i) == ',', i=1, len(row%columns))]) + 1))
      at = 1
      do i = 1, size(names)
         comma = index(row%columns(at:)//',', ',')
         names(i) = adjustl(row%columns(at:at + comma - 2))
         at = at + comma
      end do
   end function column_names

   !> Report a value outside its bounds.
   subroutine demand_bounds(self, row, entry, value)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      type(entry_type), intent(in) :: entry
      real(wp), intent(in) :: value
      logical :: fits
      fits = merge(value > row%least, value >= row%least, row%above) .and. &
             merge(value < row%most, value <= row%most, row%below)
      if (.not. fits) call demand(self%namelist, entry, .false., bounds_text(row), self%messages)
   end subroutine demand_bounds

   !> Report a value that cannot be in the units of the file. Of several numbers with one unit the largest is judged;
   !> of the velocity of blocks, whose last number is a rate of rotation, the others.
   subroutine demand_possible(self, row, entry, values)
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      type(entry_type), intent(in) :: entry
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: problem
      integer :: n, k
      logical :: scaled
      if (.not. self%known%system%is_known() .or. size(values) == 0) return
      n = size(values)
      if (row%columns == 'vx, vy, vr') n = 2
      k = maxloc(abs(values(1:n)), dim=1)
      if (values(k) < row%least .or. values(k) > row%most) return   ! reported as such
      associate (group => self%namelist%groups(self%found(1)))
         scaled = any([(group%entries(n)%name == 'table', n=1, group%n)]) .and. self%group /= 'water'
      end associate
      call self%known%problem_of(self%group, row%name, row%unit, values(k), scaled, problem)
      if (len(problem) > 0) call self%messages%add(severity%error, entry%name//': '//problem, &
                                                   self%namelist%origin(entry%values(min(k, entry%n))%place))
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
      class(option_reader_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      type(entry_type), intent(in) :: entry
      real(wp), intent(in) :: values(:, :)
      integer :: n, i
      n = size(values, 2)
      select case (row%rule)
      case (list_rule%two_points)
         call demand(self%namelist, entry, any(abs(values(1:2, 1) - values(3:4, 1)) > 0), 'the two ends must differ', &
                     self%messages)
      case (list_rule%rising, list_rule%or_constant)
         do i = 2, n
            if (values(1, i) >= values(1, i - 1)) cycle
            call demand(self%namelist, entry, .false., 'the times must not decrease', self%messages, &
                        place=(i - 1)*size(values, 1) + 1)
            exit
         end do
      case (list_rule%frequency)
         do i = 1, n
            call demand(self%namelist, entry, values(3, i) >= 0, 'the frequency must not be negative', self%messages, &
                        place=(i - 1)*size(values, 1) + 3)
         end do
      end select
   end subroutine demand_rule

end module rockdda_io_option_reader
