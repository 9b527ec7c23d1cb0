! SPDX-License-Identifier: MIT
!> Reader of analysis files (.df, .ana), both dialects. Format: docs/file-formats.md.
!>
!> The dialect follows from the number of numbers in the file. Where words stand in place of numbers, or both dialects
!> fit, the file is read in several ways, each a `reading_type`, and the one with the fewest errors is taken.
module rockdda_io_analysis_file
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : counted, to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_analysis_input, only : analysis_input_type, dialect, block_material_type, joint_material_type, &
      time_table_type
   use rockdda_model_options, only : dda_windows
   use rockdda_io_counting, only : analysis_needs, fits_geometry, find_g0_points, g0_points_fit, plain_numbers
   use rockdda_io_record_reader, only : record_reader_type, append_in_order, note_comment, report_decimal_comma, &
      report_large_count, largest_value
   use rockdda_base_numbers, only : is_whole
   use rockdda_io_source, only : source_type
   use rockdda_io_tokens, only : token_list_type, tokenise
   implicit none
   private
   public :: read_analysis_source

   character(len=*), parameter :: sor_name = 'SOR factor'

   character(len=*), parameter :: block_names(13) = [character(len=19) :: 'density', 'weight', 'Young''s modulus', &
      'Poisson''s ratio', 'initial stress s11', 'initial stress s22', 'initial stress s12', 'stress gradient t11', &
      'stress gradient t22', 'stress gradient t12', 'velocity vx', 'velocity vy', 'angular velocity vr']
   character(len=*), parameter :: joint_names(3) = [character(len=16) :: &
      'friction angle', 'cohesion', 'tensile strength']
   character(len=*), parameter :: row_names(3) = [character(len=1) :: 't', 'x', 'y']

   !> Largest number of points tried for a file with mistyped numbers and without a geometry.
   integer, parameter :: most_tried_points = 50

   !> The file, and what follows from its header and its count of numbers.
   type :: file_type
      type(token_list_type), pointer :: tokens => null()
      integer :: points(2) = -1         !! fixed and loading points of the model; < 0: unknown
      integer :: n_points = -1          !! their sum; -1: unknown
      integer :: forced = 0             !! dialect that the user named, or dialect%auto
      integer :: counts(2) = 0          !! block materials, joint materials
      integer(i8) :: needed = 0         !! numbers that dialect dda_windows needs without SOR factor
      integer(i8) :: rest = 0           !! numbers beyond these
      real(wp), allocatable :: values(:)  !! numbers outside comments
      logical :: both_fit = .false.     !! without points, one number more is the SOR factor or g0
      integer :: n_found = 0            !! numbers of points that fit, when they are unknown
      integer :: found_points(2) = -1   !! the smallest two
   contains
      procedure :: read_counts
      procedure :: choose_by_count
      procedure :: choose_by_values
      procedure :: choose_by_errors
      procedure :: read_as
      procedure :: report_dialect
      procedure :: report_misfit
      procedure :: numbers_needed
      procedure :: rows_of_points
   end type file_type

   !> The file as one dialect has it.
   type :: reading_type
      integer :: way = 0                !! one of dialect%...; dialect%auto: none fits
      integer :: n_points = 0           !! fixed and loading points
      logical :: strict = .false.       !! words on lines of their own count as mistyped numbers
      logical :: exact = .false.        !! the file has exactly the numbers that were read
      logical :: has_sor_factor = .false.
      type(record_reader_type) :: reader
      type(analysis_input_type) :: analysis
   end type reading_type

contains

   !> Read and check an analysis file; every problem is added to `messages`, and a note with the dialect that
   !> was used. The result is valid only when no error was added.
   subroutine read_analysis_source(source, n_fixed, n_loading, forced_dialect, analysis, messages)
      type(source_type), intent(in) :: source
      integer, intent(in) :: n_fixed, n_loading, forced_dialect
      type(analysis_input_type), intent(out) :: analysis
      type(diagnostics_type), intent(inout) :: messages
      type(token_list_type), target :: tokens
      type(file_type) :: file
      type(reading_type) :: best
      logical :: ok
      file%points = [n_fixed, n_loading]
      if (all(file%points >= 0)) file%n_points = sum(file%points)
      file%forced = forced_dialect
      call tokenise(source, tokens)
      file%tokens => tokens
      call file%read_counts(messages, ok)
      if (.not. ok) return
      call file%choose_by_count(best)
      if (best%way /= dialect%auto) call file%read_as(best)
      if (best%exact .and. file%both_fit .and. best%reader%messages%has_errors()) call file%choose_by_values(best)
      if (file%tokens%n_text > 0 .and. (best%reader%messages%has_errors() .or. .not. best%exact)) &
         call file%choose_by_errors(best)
      if (.not. best%exact) then
         call file%report_misfit(messages)
         return
      end if
      analysis = best%analysis
      if (best%reader%messages%has_errors()) call report_decimal_comma(file%tokens, best%reader%messages)
      ! with one number missing, the SOR factor at the end would be read as the number before it
      if (best%reader%messages%has_errors() .or. .not. best%has_sor_factor) &
         call best%reader%report_break(severity%warning)
      call append_in_order(messages, best%reader%messages)
      call file%report_dialect(best, messages)
   end subroutine read_analysis_source

   !> Read the header and count the numbers; ok is false, and the reason reported, when the numbers of materials are
   !> unknown.
   subroutine read_counts(self, messages, ok)
      class(file_type), intent(inout) :: self
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      type(diagnostics_type) :: found, strict_found
      ok = .false.
      associate (tokens => self%tokens)
         if (tokens%n == 0) then
            call messages%add(severity%error, 'the file holds no numbers', tokens%end_origin())
            return
         end if
         call read_header(self%tokens, .false., self%counts, found, ok)
         if (.not. ok .and. fits_geometry(tokens)) then
            call messages%add(severity%error, 'the numbers fit a geometry file, not an analysis file: '// &
                              'are the files swapped?', tokens%end_origin())
            return
         else if (.not. ok .and. tokens%n_text > 0) then
            ! a word in the place of a count, on a line of its own?
            call read_header(self%tokens, .true., self%counts, strict_found, ok)
            if (strict_found%n_errors <= found%n_errors) found = strict_found
         end if
         if (.not. ok) then
            call report_decimal_comma(tokens, found)
            call append_in_order(messages, found)
            return
         end if
         self%needed = analysis_needs(self%counts(1), self%counts(2))
         self%rest = tokens%n_numbers - self%needed
         self%values = plain_numbers(tokens)
      end associate
   end subroutine read_counts

   !> Read only the header.
   subroutine read_header(tokens, strict, counts, messages, ok)
      type(token_list_type), pointer, intent(in) :: tokens
      logical, intent(in) :: strict
      integer, intent(out) :: counts(2)
      type(diagnostics_type), intent(out) :: messages
      logical, intent(out) :: ok
      type(record_reader_type) :: reader
      type(analysis_input_type) :: unused
      reader%tokens => tokens
      reader%strict = strict
      call read_analysis_header(reader, unused, counts, ok)
      messages = reader%messages
   end subroutine read_header

   !> Choose the dialect whose equality of counts holds, dialect%auto when there is none.
   subroutine choose_by_count(self, reading)
      class(file_type), intent(inout) :: self
      type(reading_type), intent(inout) :: reading
      reading%n_points = self%n_points
      self%both_fit = self%rest == 1 .and. self%n_points < 1 .and. self%forced == dialect%auto
      if (self%rest >= 0 .and. self%rest <= 1 .and. self%forced /= dialect%g0) then
         reading%way = dialect%windows
      else if (self%rest < 1 .or. self%forced == dialect%windows) then
         return
      else if (self%n_points >= 0) then
         if (g0_points_fit(self%values, int(self%rest), self%n_points)) reading%way = dialect%g0
      else
         call find_g0_points(self%values, int(self%rest), self%n_found, self%found_points(1), self%found_points(2))
         if (self%n_found == 1) reading%way = dialect%g0
         reading%n_points = self%found_points(1)
      end if
   end subroutine choose_by_count

   !> Read the file in the dialect of the reading.
   subroutine read_as(self, reading)
      class(file_type), intent(in) :: self
      type(reading_type), intent(inout) :: reading   !! way, n_points, strict, reader%check: given; the rest: result
      integer :: points(2), counts(2)
      points = self%points
      if (self%n_points < 0) points = [max(0, reading%n_points), 0]
      reading%reader%tokens => self%tokens
      reading%reader%strict = reading%strict
      call read_analysis_header(reading%reader, reading%analysis, counts, reading%exact)
      reading%analysis%dialect = reading%way
      if (reading%exact) call read_analysis_body(reading%reader, points, counts, reading%analysis, reading%exact)
      reading%has_sor_factor = reading%reader%record%names(1) == sor_name
   end subroutine read_as

   !> Take dialect g0 if the values satisfy its rules. Both dialects fit, and the values break the rules of dialect
   !> dda_windows (where a file of dialect g0 has Young's modulus in place of Poisson's ratio).
   subroutine choose_by_values(self, best)
      class(file_type), intent(in) :: self
      type(reading_type), intent(inout) :: best
      type(reading_type) :: other
      other%way = dialect%g0
      call self%read_as(other)
      if (other%exact .and. .not. other%reader%messages%has_errors()) best = other
   end subroutine choose_by_values

   !> Take the reading with the fewest errors: the file contains text, perhaps in place of numbers.
   subroutine choose_by_errors(self, best)
      class(file_type), intent(in) :: self
      type(reading_type), intent(inout) :: best
      type(reading_type) :: other
      integer :: attempt, way, points, last_points
      do attempt = 1, 4
         way = merge(dialect%windows, dialect%g0, modulo(attempt, 2) == 1)
         if (self%forced /= dialect%auto .and. way /= self%forced) cycle
         last_points = self%n_points
         if (self%n_points < 0) last_points = merge(most_tried_points, 0, way == dialect%g0)
         do points = max(0, self%n_points), last_points
            other = reading_type(way=way, n_points=points, strict=attempt > 2)
            call self%read_as(other)
            if (.not. other%exact) cycle
            if (best%exact .and. other%reader%messages%n_errors >= best%reader%messages%n_errors) cycle
            best = other
         end do
      end do
   end subroutine choose_by_errors

   !> Add the note with the dialect.
   subroutine report_dialect(self, reading, messages)
      class(file_type), intent(in) :: self
      type(reading_type), intent(in) :: reading
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: text
      text = "read in dialect '"//dialect_name(reading%way)//"'"
      if (self%forced /= dialect%auto) text = text//' as requested'
      text = text//': '//counted(self%tokens%n_numbers, 'number')
      if (reading%way == dialect%g0) text = text//', '//counted(reading%n_points, 'fixed and loading point')
      if (self%both_fit .and. reading%way == dialect%windows) text = text// &
         ", the last is the SOR factor; they fit dialect 'g0' without fixed and loading points, too: "// &
         '--dialect g0 reads the number behind g1 as contact stiffness'
      if (self%both_fit .and. reading%way == dialect%g0) text = text//", no SOR factor; they fit dialect '"// &
         dda_windows//"', too: --dialect "//dda_windows//' reads the last number as SOR factor'
      call messages%add(severity%note, text, self%tokens%source%file_origin())
   end subroutine report_dialect

   !> Report why no dialect fits.
   subroutine report_misfit(self, messages)
      class(file_type), intent(in) :: self
      type(diagnostics_type), intent(inout) :: messages
      type(diagnostics_type) :: strict_found
      type(reading_type) :: farthest
      character(len=:), allocatable :: ending
      integer :: counts(2)
      logical :: ok
      associate (tokens => self%tokens)
         if (self%n_found > 1) then
            call messages%add(severity%error, 'the number of fixed and loading points does not follow from this '// &
               'file alone ('//to_string(self%found_points(1))//' and '//to_string(self%found_points(2))// &
               ' both fit): the geometry is needed', tokens%end_origin())
            return
         end if
         if (tokens%n_text > 0) then
            ! a word in the place of a count, on a line of its own?
            call read_header(self%tokens, .true., counts, strict_found, ok)
            if (.not. ok) then
               call append_in_order(messages, strict_found)
               return
            end if
         end if
         call report_decimal_comma(tokens, messages)
         call report_large_count(tokens, 3, 'number of block materials', self%counts(1), 13, messages)
         call report_large_count(tokens, 4, 'number of joint materials', self%counts(2), 3, messages)
         call find_break(self, farthest)
         ending = ''
         if (farthest%reader%n_missing > 0) ending = farthest%reader%missing_name//': the file ends here; '
         call messages%add(severity%error, ending//self%numbers_needed(), tokens%end_origin())
         farthest%reader%messages = messages
         call farthest%reader%report_break(severity%note)
         messages = farthest%reader%messages
         if (tokens%n_text > 0) call note_comment(tokens, messages)
      end associate
   end subroutine report_misfit

   !> Read the file, which has too many or too few numbers, in each possible dialect, and keep the reading whose records
   !> follow the lines of the file furthest.
   subroutine find_break(file, farthest)
      type(file_type), intent(in) :: file
      type(reading_type), intent(out) :: farthest
      type(reading_type) :: other
      integer :: way, points, last_points, end_of_other, end_of_farthest
      end_of_farthest = 0
      do way = dialect%windows, dialect%g0
         if (file%forced /= dialect%auto .and. way /= file%forced) cycle
         last_points = file%n_points
         if (file%n_points < 0) last_points = merge(most_tried_points, 0, way == dialect%g0)
         do points = max(0, file%n_points), last_points
            other = reading_type(way=way, n_points=points)
            other%reader%check = .false.
            call file%read_as(other)
            end_of_other = merge(other%reader%broken_at, other%reader%at, other%reader%broken_at > 0)
            if (end_of_other <= end_of_farthest) cycle
            end_of_farthest = end_of_other
            farthest = other
         end do
      end do
   end subroutine find_break

   !> The numbers found, and those that each dialect needs.
   function numbers_needed(self) result(text)
      class(file_type), intent(in) :: self
      character(len=:), allocatable :: text
      integer(i8) :: rows
      text = 'found '//counted(self%tokens%n_numbers, 'number')//' for '//counted(self%counts(1), 'block material')// &
             ' and '//counted(self%counts(2), 'joint material')
      if (self%forced /= dialect%g0) text = text//"; dialect '"//dda_windows//"' needs "//to_string(self%needed)// &
                                            ' (or '//to_string(self%needed + 1)//' with an SOR factor)'
      if (self%forced == dialect%windows) return
      text = text//"; dialect 'g0' needs "
      if (self%n_points < 0) then
         text = text//to_string(self%needed + 2)//' + P + 3 rows (one less without SOR factor) for P fixed and '// &
                'loading points, and no P fits'
         return
      end if
      rows = -1
      if (self%rest >= 1 + self%n_points) rows = self%rows_of_points()
      associate (least => self%needed + 1 + self%n_points)
         if (rows >= 0) then
            text = text//to_string(least + 1 + 3*rows)//' (or '//to_string(least + 3*rows)// &
                   ' without SOR factor) with '//to_string(rows)//' rows'
         else
            text = text//'at least '//to_string(least)
         end if
      end associate
      text = text//' for '//counted(self%n_points, 'fixed and loading point')
   end function numbers_needed

   !> Rows of time-dependent values as counted in the file, -1 when the counts are not whole.
   pure integer(i8) function rows_of_points(self)
      class(file_type), intent(in) :: self
      integer :: k
      rows_of_points = -1
      if (size(self%values) < 7 + self%n_points) return
      do k = 8, 7 + self%n_points
         if (.not. is_whole(self%values(k)) .or. self%values(k) < 0) return
      end do
      rows_of_points = sum(nint(self%values(8:7 + self%n_points), i8))
   end function rows_of_points

   !> Name of a dialect for messages.
   pure function dialect_name(way) result(name)
      integer, intent(in) :: way           !! one of dialect%...
      character(len=:), allocatable :: name
      name = dda_windows
      if (way == dialect%g0) name = 'g0'
   end function dialect_name

   !> Read k01, number of steps, numbers of materials, g2, g1. ok is false when the numbers of materials are unknown.
   subroutine read_analysis_header(reader, analysis, counts, ok)
      type(record_reader_type), intent(inout) :: reader
      type(analysis_input_type), intent(inout) :: analysis
      integer, intent(out) :: counts(2)           !! block materials, joint materials
      logical, intent(out) :: ok
      call reader%read_record(['k01'], '', 0)
      analysis%k01 = reader%record%value(1)
      call reader%require(analysis%k01 >= 0 .and. analysis%k01 <= 1, 1, 'must be between 0 (static) and 1 (dynamic)')
      call reader%read_count('number of time steps', analysis%n_steps)
      call reader%read_count('number of block materials', counts(1))
      call reader%require(counts(1) /= 0, 1, 'must be at least 1')
      call reader%read_count('number of joint materials', counts(2))
      call reader%require(counts(2) /= 0, 1, 'must be at least 1')
      call read_positive('displacement ratio g2', analysis%displacement_ratio)
      call read_positive('largest time step g1', analysis%dt_max)
      ok = all(counts > 0)
      if (reader%n_missing > 0) then
         call reader%messages%add(severity%error, reader%missing_name//': the file ends here', &
                                  reader%tokens%end_origin())
         ok = .false.
      end if

   contains

      !> Read a record of one number greater than 0.
      subroutine read_positive(name, value)
         character(len=*), intent(in) :: name
         real(wp), intent(out) :: value
         call reader%read_record([name], '', 0)
         value = reader%record%value(1)
         call reader%require(value > 0, 1, 'must be greater than 0')
         call reader%require_size(largest_value)
      end subroutine read_positive

   end subroutine read_analysis_header

   !> Read all records after g1. `exact` is true when the file has exactly the numbers that were read; otherwise the
   !> content is invalid.
   subroutine read_analysis_body(reader, n_points, counts, analysis, exact)
      type(record_reader_type), intent(inout) :: reader  !! after the header
      integer, intent(in) :: n_points(2)                 !! fixed and loading points, used in dialect g0
      integer, intent(in) :: counts(2)                   !! block materials, joint materials
      type(analysis_input_type), intent(inout) :: analysis !! with its dialect
      logical, intent(out) :: exact
      integer :: i
      exact = .false.
      ! counts that exceed the file by far are refused before memory is allocated
      if (analysis_needs(counts(1), counts(2)) > 2_i8*reader%tokens%n) return
      allocate (analysis%block_materials(counts(1)), analysis%joint_materials(counts(2)))
      if (analysis%dialect == dialect%g0) then
         call reader%read_record(['contact stiffness g0'], '', 0)
         analysis%stiffness = reader%record%value(1)
         call reader%require(analysis%stiffness >= 0, 1, 'must not be negative (0: automatic)')
         call reader%require_size(largest_value)
         call read_tables(reader, n_points, analysis%fixed_tables, analysis%loading_tables, exact)
         if (.not. exact) return
      else
         allocate (analysis%fixed_tables(0), analysis%loading_tables(0))
      end if
      do i = 1, counts(1)
         if (.not. reader%goes_on()) exit
         call read_block_material(reader, i, analysis%block_materials(i))
      end do
      do i = 1, counts(2)
         if (.not. reader%goes_on()) exit
         call read_joint_material(reader, i, analysis%joint_materials(i))
      end do
      if (reader%n_missing == 0 .and. reader%numbers_left() > 0) call read_sor_factor(reader, analysis%sor_factor)
      exact = reader%is_exact() .or. reader%too_many_errors()
   end subroutine read_analysis_body

   !> Read time-dependent values: all counts, then all rows, fixed points first.
   subroutine read_tables(reader, n_points, fixed, loading, ok)
      type(record_reader_type), intent(inout) :: reader
      integer, intent(in) :: n_points(2)                 !! fixed, loading
      type(time_table_type), allocatable, intent(out) :: fixed(:), loading(:)
      logical, intent(out) :: ok
      integer :: n_rows(sum(n_points))
      integer :: k
      ok = .false.
      do k = 1, size(n_rows)
         if (reader%n_missing > 0) return
         call reader%read_count('number of time-dependent values of '//point_name(merge(1, 2, k <= n_points(1)))// &
                                ' '//to_string(merge(k, k - n_points(1), k <= n_points(1))), n_rows(k))
      end do
      n_rows = max(n_rows, 0)
      if (3*sum(int(n_rows, i8)) > reader%tokens%n - reader%at + 1) return
      allocate (fixed(n_points(1)), loading(n_points(2)))
      do k = 1, n_points(1)
         call read_table(reader, point_name(1), k, n_rows(k), fixed(k))
      end do
      do k = 1, n_points(2)
         call read_table(reader, point_name(2), k, n_rows(n_points(1) + k), loading(k))
      end do
      ok = reader%goes_on()
   end subroutine read_tables

   !> "fixed point" for 1, "loading point" for 2.
   pure function point_name(kind) result(name)
      integer, intent(in) :: kind
      character(len=:), allocatable :: name
      name = trim(merge('fixed point  ', 'loading point', kind == 1))
   end function point_name

   !> Read the rows t x y of one point.
   subroutine read_table(reader, object, number, n_rows, table)
      type(record_reader_type), intent(inout) :: reader
      character(len=*), intent(in) :: object             !! 'fixed point'
      integer, intent(in) :: number, n_rows
      type(time_table_type), intent(inout) :: table
      integer :: row
      allocate (table%rows(3, n_rows))
      do row = 1, n_rows
         if (.not. reader%goes_on()) return
         call reader%read_record(row_names, 'row '//to_string(row)//' of '//object, number)
         table%rows(:, row) = reader%record%value(1:3)
         call reader%require_size(largest_value)
         if (row == 1) then
            table%origin = reader%record_origin()
            cycle
         end if
         call reader%require(table%rows(1, row) >= table%rows(1, row - 1), 1, &
                             'must not be smaller than in the row before')
      end do
   end subroutine read_table

   !> Read the 13 numbers of a block material.
   subroutine read_block_material(reader, number, material)
      type(record_reader_type), intent(inout) :: reader
      integer, intent(in) :: number
      type(block_material_type), intent(inout) :: material
      call reader%read_record(block_names, 'block material', number)
      call material%set_numbers(reader%record%value(1:13))
      call reader%require(material%density > 0, 1, 'must be greater than 0')
      call reader%require(material%youngs_modulus > 0, 3, 'must be greater than 0')
      call reader%require(material%poisson_ratio > -1 .and. material%poisson_ratio < 0.5_wp, 4, &
                          'must be between -1 and 0.5')
      call reader%require_size(largest_value)
   end subroutine read_block_material

   !> Read the 3 numbers of a joint material.
   subroutine read_joint_material(reader, number, material)
      type(record_reader_type), intent(inout) :: reader
      integer, intent(in) :: number
      type(joint_material_type), intent(inout) :: material
      call reader%read_record(joint_names, 'joint material', number)
      material%friction_angle = reader%record%value(1)
      material%cohesion = reader%record%value(2)
      material%tension = reader%record%value(3)
      call reader%require(material%friction_angle >= 0 .and. material%friction_angle < 90, 1, &
                          'must be at least 0 and less than 90 degrees')
      call reader%require(material%cohesion >= 0, 2, 'must not be negative')
      call reader%require(material%tension >= 0, 3, 'must not be negative')
      call reader%require_size(largest_value)
   end subroutine read_joint_material

   !> Read the factor at the end of the file.
   subroutine read_sor_factor(reader, factor)
      type(record_reader_type), intent(inout) :: reader
      real(wp), intent(inout) :: factor              !! unchanged when the file has no valid one
      real(wp) :: found
      integer :: place, before
      logical :: behind                              !! other numbers of its line, one of which it may be
      call reader%read_record([sor_name], '', 0)
      if (reader%record%token(1) == 0) return
      found = reader%record%value(1)
      place = reader%record%token(1)
      behind = .false.
      if (place > 1) behind = reader%tokens%line(place - 1) == reader%tokens%line(place)
      before = reader%messages%n_errors
      if (found >= 1 .and. found < 2) then
         factor = found
         if (behind) call report_shift(reader, .false.)
      else
         if (before == 0) call report_shift(reader, behind)
         if (reader%messages%n_errors == before) call reader%messages%add(severity%note, 'SOR factor '// &
            to_string(found)//' is outside [1, 2): 1.4 is used', reader%tokens%origin(place))
      end if
   end subroutine read_sor_factor

   !> Report a decimal comma in a file with an SOR factor: one number too many shifts all that follow it, so that the
   !> last one is taken as the factor.
   subroutine report_shift(reader, in_a_row)
      type(record_reader_type), intent(inout) :: reader    !! after the factor
      logical, intent(in) :: in_a_row                !! also commas of which several follow one another
      character(len=:), allocatable :: first, second
      integer :: i
      do i = 1, reader%tokens%n - 1
         if (.not. reader%tokens%has_decimal_comma(i, in_a_row)) cycle
         first = reader%tokens%text(i)
         second = reader%tokens%text(i + 1)
         call reader%messages%add(severity%error, "'"//first//','// &
                                  second//"' is two numbers, because a comma separates "// &
                                  'numbers, and the last number of the file, '//to_string(reader%record%value(1))// &
                                  ', is then read as an SOR factor: for a decimal comma write '//first//'.'// &
                                  second//', for two numbers '//first//' '//second, reader%tokens%origin(i))
         return
      end do
   end subroutine report_shift

end module rockdda_io_analysis_file
