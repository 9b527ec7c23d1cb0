! SPDX-License-Identifier: MIT
!> Reader of geometry files (.dc, .geo). Format: docs/file-formats.md.
module rockdda_io_geometry_file
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : counted, to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_io_counting, only : geometry_needs, fits_analysis
   use rockdda_io_record_reader, only : record_reader_type, largest_coordinate, smallest_length, largest_value, &
                                        append_in_order, note_comment, report_decimal_comma, report_large_count
   use rockdda_io_source, only : source_type, read_source
   use rockdda_io_tokens, only : token_list_type, tokenise
   implicit none
   private
   public :: read_geometry_file, read_geometry_source

   character(len=*), parameter :: count_names(8) = [character(len=25) :: 'number of lines', &
      'number of boundary lines', 'number of material lines', 'number of bolts', 'number of fixed lines', &
      'number of loading points', 'number of measured points', 'number of hole points']
   character(len=*), parameter :: bolt_names(7) = [character(len=10) :: 'x1', 'y1', 'x2', 'y2', &
                                                   'stiffness', 'pretension', 'strength']
   character(len=*), parameter :: end_names(4) = [character(len=2) :: 'x1', 'y1', 'x2', 'y2']
   character(len=*), parameter :: point_names(2) = [character(len=1) :: 'x', 'y']
   !> Smallest ratio of e0 to the largest coordinate: 50 times the spacing of double precision numbers.
   real(wp), parameter :: smallest_distance = 1.0e-14_wp
   character(len=*), parameter :: distance_name = 'minimum edge-node distance e0'

contains

   !> Read and check a geometry file; every problem is added to `messages`. The geometry is valid only when
   !> no error was added.
   subroutine read_geometry_file(path, geometry, messages)
      character(len=*), intent(in) :: path
      type(geometry_input_type), intent(out) :: geometry
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      logical :: ok
      call read_source(path, source, messages, ok)
      if (ok) call read_geometry_source(source, geometry, messages)
   end subroutine read_geometry_file

   !> As read_geometry_file, from text in memory.
   subroutine read_geometry_source(source, geometry, messages)
      type(source_type), intent(in) :: source
      type(geometry_input_type), intent(out) :: geometry
      type(diagnostics_type), intent(inout) :: messages
      type(token_list_type) :: tokens
      type(record_reader_type) :: start, strict_start
      type(diagnostics_type) :: found, strict_found, header_found, no_messages
      real(wp) :: distance
      integer :: counts(8), header_counts(8)
      logical :: ok, header_ok, strict_ok

      call tokenise(source, tokens)
      if (tokens%n == 0) then
         call messages%add(severity%error, 'the file holds no numbers', tokens%end_origin())
         return
      end if
      call read_header(tokens, start, distance, header_counts, header_found, header_ok)
      if (.not. header_ok .and. fits_analysis(tokens)) then
         call messages%add(severity%error, 'the numbers fit an analysis file, not a geometry file: '// &
                           'are the files swapped?', tokens%end_origin())
         return
      end if
      ok = .false.
      if (header_ok .and. geometry_needs(header_counts, 4) == tokens%n_numbers) then
         call try(4, .false., ok)
      else if (header_ok .and. geometry_needs(header_counts, 7) == tokens%n_numbers) then
         call try(7, .false., ok)
      end if
      if (.not. ok .and. tokens%n_text > 0) then
         ! the count does not fit, perhaps because of mistyped numbers: find the reading that fits with them
         call try(4, .false., ok)
         if (.not. ok) call try(7, .false., ok)
         if (.not. ok) call try(4, .true., ok)
         if (.not. ok) call try(7, .true., ok)
      end if
      if (.not. ok) then
         found = header_found
         strict_ok = .true.
         if (tokens%n_text > 0) then
            ! a word in place of a count, on a line of its own?
            strict_start = record_reader_type(strict=.true.)
            call read_header(tokens, strict_start, distance, counts, strict_found, strict_ok)
         end if
         if (.not. strict_ok .and. (header_ok .or. strict_found%n_errors <= found%n_errors)) then
            found = strict_found
         else if (header_ok) then
            call report_count(tokens, start, header_counts, found)
            call note_comment(tokens, found)
         end if
      end if
      if (found%has_errors()) call report_decimal_comma(tokens, found)
      call append_in_order(messages, found)

   contains

      !> Read the file with a given number of values per bolt.
      subroutine try(per_bolt, strict, exact)
         integer, intent(in) :: per_bolt
         logical, intent(in) :: strict
         logical, intent(out) :: exact          !! the file has exactly the numbers that were read
         type(record_reader_type) :: reader, cursor
         integer :: numbers(8)
         found = no_messages
         cursor%strict = strict
         call read_header(tokens, cursor, distance, numbers, found, exact)
         ! counts that exceed the file are refused before memory is allocated
         if (exact) exact = geometry_needs(numbers, per_bolt) <= tokens%n
         if (.not. exact) return
         call read_body(tokens, cursor, numbers, per_bolt, .true., reader, geometry, found)
         exact = reader%is_exact(tokens) .or. reader%too_many_errors(found)
         geometry%edge_node_distance = distance
         geometry%n_boundary = numbers(2)
         call check_distance()
      end subroutine try

      !> e0 must be larger than the rounding of the coordinates.
      subroutine check_distance()
         type(record_reader_type) :: first
         type(diagnostics_type) :: ignored
         character(len=len(distance_name)) :: names(1)
         real(wp) :: largest
         names(1) = distance_name
         largest = maxval(abs(geometry%lines))
         if (largest > largest_coordinate .or. .not. distance >= smallest_length) return
         if (distance >= smallest_distance*largest) return
         call first%read_record(tokens, names, '', 0, ignored)
         call first%require(tokens, .false., 1, names(1), '', 0, 'must be at least '//to_string(smallest_distance)// &
                            ' of the largest coordinate, '//to_string(largest), found)
      end subroutine check_distance

   end subroutine read_geometry_source

   !> The distance e0 and the eight counts.
   subroutine read_header(tokens, reader, distance, counts, messages, ok)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(inout) :: reader
      real(wp), intent(out) :: distance
      integer, intent(out) :: counts(8)
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      character(len=len(distance_name)) :: names(1)
      integer :: k
      names(1) = distance_name
      counts = -1
      call reader%read_record(tokens, names, '', 0, messages)
      distance = reader%record%value(1)
      call reader%require(tokens, distance > 0, 1, names(1), '', 0, 'must be greater than 0', messages)
      call reader%require(tokens, distance >= smallest_length .or. distance <= 0, 1, names(1), '', 0, &
                          'must be at least '//to_string(smallest_length), messages)
      call reader%require_size(tokens, largest_coordinate, names, '', 0, messages)
      do k = 1, 8
         call reader%read_count(tokens, trim(count_names(k)), counts(k), messages)
         if (k == 2 .and. counts(1) >= 0 .and. counts(2) > counts(1)) then
            call reader%require(tokens, .false., 1, trim(count_names(2)), '', 0, 'must not be larger than the '// &
                                trim(count_names(1))//' ('//to_string(counts(1))//')', messages)
            counts(2) = counts(1)
         end if
      end do
      ok = all(counts >= 0)
      if (reader%n_missing > 0) then
         call messages%add(severity%error, reader%missing_name//': the file ends here', tokens%end_origin())
         ok = .false.
      else if (ok .and. counts(1) == 0) then
         call messages%add(severity%error, 'the geometry has no lines', tokens%origin(min(2, tokens%n)))
         ok = .false.
      end if
   end subroutine read_header

   !> Read all records after the counts.
   subroutine read_body(tokens, start, counts, per_bolt, keep, reader, geometry, messages)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(in) :: start
      integer, intent(in) :: counts(8)
      integer, intent(in) :: per_bolt          !! numbers per bolt, 4 or 7
      logical, intent(in) :: keep              !! store and check; otherwise only find missing numbers
      type(record_reader_type), intent(out) :: reader
      type(geometry_input_type), intent(inout) :: geometry
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: v(16)
      integer :: i

      reader = start
      reader%check = keep
      if (keep) call geometry%allocate_all(counts(1), counts(3), merge(counts(4), 0, per_bolt == 7), counts(5), &
                                           counts(6), counts(7), counts(8))
      do i = 1, counts(1)
         if (done()) return
         call read_line('line', 'joint material')
         if (keep) then
            geometry%lines(:, i) = v(1:4)
            geometry%line_joint(i) = reader%to_whole(tokens, 5, 'joint material', 'line', i, messages)
            geometry%line_origin(i) = reader%record_origin(tokens)
            if (no_length() .and. all(reader%record%token(1:4) > 0)) call messages%add(severity%warning, &
               'line '//to_string(i)//' has no length', reader%record_origin(tokens))
         end if
      end do
      do i = 1, counts(3)
         if (done()) return
         call read_line('material line', 'block material')
         if (keep) then
            geometry%material_lines(:, i) = v(1:4)
            geometry%line_material(i) = reader%to_whole(tokens, 5, 'block material', 'material line', i, messages)
            geometry%material_line_origin(i) = reader%record_origin(tokens)
         end if
      end do
      do i = 1, counts(4)
         if (done()) return
         call reader%read_record(tokens, bolt_names(1:per_bolt), 'bolt', i, messages)
         if (keep .and. i == 1 .and. per_bolt == 4) call messages%add(severity%warning, counted(counts(4), 'bolt')// &
            ' without stiffness ignored (4 numbers each, 7 are needed)', reader%record_origin(tokens))
         if (keep) call reader%require_size(tokens, largest_coordinate, bolt_names(1:4), 'bolt', i, messages)
         if (keep .and. per_bolt == 7) call take_bolt()
      end do
      do i = 1, counts(5)
         if (done()) return
         call read_numbers(end_names, 'fixed line')
         if (.not. keep) cycle
         geometry%fixed_lines(:, i) = v(1:4)
         geometry%fixed_origin(i) = reader%record_origin(tokens)
      end do
      do i = 1, counts(6)
         if (done()) return
         call read_numbers(point_names, 'loading point')
         if (.not. keep) cycle
         geometry%loading_points(:, i) = v(1:2)
         geometry%loading_origin(i) = reader%record_origin(tokens)
      end do
      do i = 1, counts(7)
         if (done()) return
         call read_numbers(point_names, 'measured point')
         if (.not. keep) cycle
         geometry%measured_points(:, i) = v(1:2)
         geometry%measured_origin(i) = reader%record_origin(tokens)
      end do
      do i = 1, counts(8)
         if (done()) return
         call read_numbers(point_names, 'hole point')
         if (.not. keep) cycle
         geometry%hole_points(:, i) = v(1:2)
         geometry%hole_origin(i) = reader%record_origin(tokens)
      end do

   contains

      !> End of the file, or too many errors?
      logical function done()
         done = reader%n_missing > 0 .or. reader%too_many_errors(messages)
      end function done

      !> Both ends and a material number of line i.
      subroutine read_line(object, material)
         character(len=*), intent(in) :: object, material
         character(len=max(2, len(material))) :: names(5)
         names(1:4) = end_names
         names(5) = material
         call reader%read_record(tokens, names, object, i, messages)
         v = reader%record%value
         call reader%require_size(tokens, largest_coordinate, end_names, object, i, messages)
      end subroutine read_line

      !> Coordinates of object i.
      subroutine read_numbers(names, object)
         character(len=*), intent(in) :: names(:), object
         call reader%read_record(tokens, names, object, i, messages)
         v = reader%record%value
         call reader%require_size(tokens, largest_coordinate, names, object, i, messages)
      end subroutine read_numbers

      !> Bolt i with its three values.
      subroutine take_bolt()
         v = reader%record%value
         geometry%bolts(:, i) = v(1:4)
         geometry%bolt_values(:, i) = v(5:7)
         geometry%bolt_origin(i) = reader%record_origin(tokens)
         call reader%require(tokens, v(5) > 0, 5, 'stiffness', 'bolt', i, 'must be greater than 0', messages)
         call reader%require(tokens, v(7) >= 0, 7, 'strength', 'bolt', i, 'must not be negative (0: unlimited)', &
                             messages)
         call reader%require(tokens, maxval(abs(v(5:7))) <= largest_value, 5, 'values', 'bolt', i, &
                             'must not be larger than '//to_string(largest_value), messages)
         if (no_length()) call reader%require(tokens, .false., 1, 'bolt '//to_string(i), '', 0, &
                                              'its ends must not agree', messages)
      end subroutine take_bolt

      !> Are both ends of the last record equal?
      pure logical function no_length()
         no_length = .not. (abs(v(1) - v(3)) > 0 .or. abs(v(2) - v(4)) > 0)
      end function no_length

   end subroutine read_body

   !> Report too many or too few numbers: the expected count and the place where the file ends.
   subroutine report_count(tokens, start, counts, messages)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(in) :: start
      integer, intent(in) :: counts(8)
      type(diagnostics_type), intent(inout) :: messages
      type(record_reader_type) :: reader
      type(geometry_input_type) :: unused
      character(len=:), allocatable :: text
      integer :: per_bolt, k
      integer, parameter :: each(8) = [5, 0, 5, 4, 4, 2, 2, 2]   ! numbers of one line, ...

      do k = 1, 8
         call report_large_count(tokens, 1 + k, trim(count_names(k)), counts(k), each(k), messages)
      end do
      per_bolt = merge(7, 4, geometry_needs(counts, 7) <= tokens%n_numbers)
      call read_body(tokens, start, counts, per_bolt, .false., reader, unused, messages)
      text = ''
      if (reader%n_missing > 0) text = reader%missing_name//': the file ends here; '
      text = text//'expected '//to_string(geometry_needs(counts, 4))//' numbers'
      if (counts(4) > 0) text = text//' (bolts of 4) or '//to_string(geometry_needs(counts, 7))//' (bolts of 7)'
      text = text//' for '//counted(counts(1), 'line')//', '//counted(counts(3), 'material line')//', '// &
             counted(counts(4), 'bolt')//', '//counted(counts(5), 'fixed line')//' and '// &
             points_text(counts(6:8))//', found '//to_string(tokens%n_numbers)
      if (fits_analysis(tokens)) text = text//'; the numbers fit an analysis file: are the files swapped?'
      call messages%add(severity%error, text, tokens%end_origin())
      if (reader%broken_at > 0) call messages%add(severity%note, &
         'from here on the numbers do not fit the lines of the file: one may be missing or too many', &
         tokens%origin(reader%broken_at))
   end subroutine report_count

   !> "12 loading, measured and hole points".
   pure function points_text(counts) result(text)
      integer, intent(in) :: counts(3)
      character(len=:), allocatable :: text
      integer(i8) :: n
      n = sum(int(counts, i8))
      text = to_string(n)//' loading, measured and hole point'
      if (n /= 1) text = text//'s'
   end function points_text

end module rockdda_io_geometry_file
