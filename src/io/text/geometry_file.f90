! SPDX-License-Identifier: MIT
!> Reader of geometry files (.dc, .geo). Format: docs/file-formats.md.
module rockdda_io_geometry_file
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : counted, to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_model_blocks, only : largest_coordinate
   use rockdda_model_geometry_input, only : geometry_input_type, bolt_type
   use rockdda_io_counting, only : geometry_needs, fits_analysis
   use rockdda_io_record_reader, only : record_reader_type, smallest_length, largest_value, &
                                        append_in_order, note_comment, report_break, report_decimal_comma, &
                                        report_large_count
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
   !> Numbers of a bolt, in the order in which they are tried.
   integer, parameter :: bolt_sizes(2) = [4, 7]

   !> The numbers before the lines.
   type :: header_type
      real(wp) :: distance = 0                !! e0
      integer :: counts(8) = -1               !! as in count_names
      type(record_reader_type) :: reader      !! behind the counts
   end type header_type

   !> Reader of the records after the counts.
   type, extends(record_reader_type) :: body_reader_type
      integer :: per_bolt = 4                 !! numbers of a bolt, one of bolt_sizes
   contains
      procedure :: read_body
      procedure :: read_lines
      procedure :: read_points
      procedure :: read_bolts
      procedure :: has_no_length
   end type body_reader_type

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

   !> Read text in memory as read_geometry_file reads a file.
   subroutine read_geometry_source(source, geometry, messages)
      type(source_type), intent(in) :: source
      type(geometry_input_type), intent(out) :: geometry
      type(diagnostics_type), intent(inout) :: messages
      type(token_list_type) :: tokens
      type(header_type) :: header
      type(diagnostics_type) :: found
      logical :: header_ok, ok
      integer :: way

      call tokenise(source, tokens)
      if (tokens%n == 0) then
         call messages%add(severity%error, 'the file holds no numbers', tokens%end_origin())
         return
      end if
      call read_header(tokens, .false., header, found, header_ok)
      if (.not. header_ok .and. fits_analysis(tokens)) then
         call messages%add(severity%error, 'the numbers fit an analysis file, not a geometry file: '// &
                           'are the files swapped?', tokens%end_origin())
         return
      end if
      ok = .false.
      do way = 1, 2
         if (ok .or. .not. header_ok) exit
         if (geometry_needs(header%counts, bolt_sizes(way)) /= tokens%n_numbers) cycle
         call read_as(tokens, bolt_sizes(way), .false., geometry, found, ok)
      end do
      ! the count does not fit, perhaps because of mistyped numbers: find the reading that fits with them
      do way = 1, 4
         if (ok .or. tokens%n_text == 0) exit
         call read_as(tokens, bolt_sizes(2 - modulo(way, 2)), way > 2, geometry, found, ok)
      end do
      if (.not. ok) call report_misfit(tokens, found)
      if (found%has_errors()) call report_decimal_comma(tokens, found)
      call append_in_order(messages, found)
   end subroutine read_geometry_source

   !> Read the file with a given number of values per bolt.
   subroutine read_as(tokens, per_bolt, strict, geometry, messages, exact)
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: per_bolt
      logical, intent(in) :: strict
      type(geometry_input_type), intent(inout) :: geometry
      type(diagnostics_type), intent(out) :: messages
      logical, intent(out) :: exact          !! the file has exactly the numbers that were read
      type(body_reader_type) :: body
      type(header_type) :: header
      call read_header(tokens, strict, header, messages, exact)
      ! counts that exceed the file are refused before memory is allocated
      if (exact) exact = geometry_needs(header%counts, per_bolt) <= tokens%n
      if (.not. exact) return
      body%record_reader_type = header%reader
      body%per_bolt = per_bolt
      call body%read_body(tokens, header%counts, geometry, messages)
      exact = body%is_exact(tokens) .or. body%too_many_errors(messages)
      geometry%edge_node_distance = header%distance
      geometry%n_boundary = header%counts(2)
      call check_distance(tokens, header%distance, maxval(abs(geometry%lines)), messages)
   end subroutine read_as

   !> Report an e0 that is not larger than the rounding of the coordinates.
   subroutine check_distance(tokens, distance, largest, messages)
      type(token_list_type), intent(in) :: tokens
      real(wp), intent(in) :: distance
      real(wp), intent(in) :: largest        !! coordinate
      type(diagnostics_type), intent(inout) :: messages
      type(record_reader_type) :: first
      type(diagnostics_type) :: ignored
      if (largest > largest_coordinate .or. .not. distance >= smallest_length) return
      if (distance >= smallest_distance*largest) return
      call first%read_record(tokens, [distance_name], '', 0, ignored)
      call first%require(tokens, .false., 1, 'must be at least '//to_string(smallest_distance)// &
                         ' of the largest coordinate, '//to_string(largest), messages)
   end subroutine check_distance

   !> Report why no reading fits the file.
   subroutine report_misfit(tokens, messages)
      type(token_list_type), intent(in) :: tokens
      type(diagnostics_type), intent(out) :: messages
      type(header_type) :: header, strict_header
      type(diagnostics_type) :: strict_messages
      logical :: ok, strict_ok
      call read_header(tokens, .false., header, messages, ok)
      strict_ok = .true.
      ! a word in place of a count, on a line of its own?
      if (tokens%n_text > 0) call read_header(tokens, .true., strict_header, strict_messages, strict_ok)
      if (.not. strict_ok .and. (ok .or. strict_messages%n_errors <= messages%n_errors)) then
         messages = strict_messages
      else if (ok) then
         call report_count(tokens, header, messages)
         call note_comment(tokens, messages)
      end if
   end subroutine report_misfit

   !> Read the distance e0 and the eight counts.
   subroutine read_header(tokens, strict, header, messages, ok)
      type(token_list_type), intent(in) :: tokens
      logical, intent(in) :: strict
      type(header_type), intent(out) :: header
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      integer :: k
      header%reader%strict = strict
      associate (reader => header%reader, counts => header%counts, distance => header%distance)
         call reader%read_record(tokens, [distance_name], '', 0, messages)
         distance = reader%record%value(1)
         call reader%require(tokens, distance > 0, 1, 'must be greater than 0', messages)
         call reader%require(tokens, distance >= smallest_length .or. distance <= 0, 1, &
                             'must be at least '//to_string(smallest_length), messages)
         call reader%require_size(tokens, largest_coordinate, messages)
         do k = 1, 8
            call reader%read_count(tokens, trim(count_names(k)), counts(k), messages)
            if (k == 2 .and. counts(1) >= 0 .and. counts(2) > counts(1)) then
               call reader%require(tokens, .false., 1, 'must not be larger than the '//trim(count_names(1))//' ('// &
                                   to_string(counts(1))//')', messages)
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
      end associate
   end subroutine read_header

   !> Read all records after the counts, and store them unless they are only counted (check is false).
   subroutine read_body(self, tokens, counts, geometry, messages)
      class(body_reader_type), intent(inout) :: self
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: counts(8)
      type(geometry_input_type), intent(inout) :: geometry
      type(diagnostics_type), intent(inout) :: messages
      if (self%check) call geometry%allocate_all(counts(1), counts(3), merge(counts(4), 0, self%per_bolt == 7), &
                                                 counts(5), counts(6), counts(7), counts(8))
      call self%read_lines(tokens, 'line', counts(1), geometry%lines, geometry%line_joint, geometry%line_origin, &
                           messages)
      call self%read_lines(tokens, 'material line', counts(3), geometry%material_lines, geometry%line_material, &
                           geometry%material_line_origin, messages)
      call self%read_bolts(tokens, counts(4), geometry, messages)
      call self%read_points(tokens, 'fixed line', end_names, counts(5), geometry%fixed_lines, &
                            geometry%fixed_origin, messages)
      call self%read_points(tokens, 'loading point', point_names, counts(6), geometry%loading_points, &
                            geometry%loading_origin, messages)
      call self%read_points(tokens, 'measured point', point_names, counts(7), geometry%measured_points, &
                            geometry%measured_origin, messages)
      call self%read_points(tokens, 'hole point', point_names, counts(8), geometry%hole_points, &
                            geometry%hole_origin, messages)
   end subroutine read_body

   !> Read lines: both ends and a material number.
   subroutine read_lines(self, tokens, object, n, ends, number, origin, messages)
      class(body_reader_type), intent(inout) :: self
      type(token_list_type), intent(in) :: tokens
      character(len=*), intent(in) :: object             !! 'line' or 'material line'
      integer, intent(in) :: n
      real(wp), intent(inout), allocatable :: ends(:, :)
      integer, intent(inout), allocatable :: number(:)   !! of the material
      type(origin_type), intent(inout), allocatable :: origin(:)
      type(diagnostics_type), intent(inout) :: messages
      character(len=14) :: names(5)
      integer :: i
      names(1:4) = end_names
      names(5) = merge('joint material', 'block material', object == 'line')
      do i = 1, n
         if (.not. self%goes_on(messages)) return
         call self%read_record(tokens, names, object, i, messages)
         call self%require_size(tokens, largest_coordinate, messages, 4)
         if (.not. self%check) cycle
         ends(:, i) = self%record%value(1:4)
         number(i) = self%to_whole(tokens, 5, messages)
         origin(i) = self%record_origin(tokens)
         if (object == 'line' .and. self%has_no_length() .and. all(self%record%token(1:4) > 0)) &
            call messages%add(severity%warning, 'line '//to_string(i)//' has no length', origin(i))
      end do
   end subroutine read_lines

   !> Read points, or fixed lines with their ends.
   subroutine read_points(self, tokens, object, names, n, position, origin, messages)
      class(body_reader_type), intent(inout) :: self
      type(token_list_type), intent(in) :: tokens
      character(len=*), intent(in) :: object, names(:)
      integer, intent(in) :: n
      real(wp), intent(inout), allocatable :: position(:, :)
      type(origin_type), intent(inout), allocatable :: origin(:)
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      do i = 1, n
         if (.not. self%goes_on(messages)) return
         call self%read_record(tokens, names, object, i, messages)
         call self%require_size(tokens, largest_coordinate, messages)
         if (.not. self%check) cycle
         position(:, i) = self%record%value(1:size(names))
         origin(i) = self%record_origin(tokens)
      end do
   end subroutine read_points

   !> Read bolts; those with 4 numbers are ignored.
   subroutine read_bolts(self, tokens, n, geometry, messages)
      class(body_reader_type), intent(inout) :: self
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: n
      type(geometry_input_type), intent(inout) :: geometry
      type(diagnostics_type), intent(inout) :: messages
      integer :: i, k
      do i = 1, n
         if (.not. self%goes_on(messages)) return
         call self%read_record(tokens, bolt_names(1:self%per_bolt), 'bolt', i, messages)
         call self%require_size(tokens, largest_coordinate, messages, 4)
         if (self%check .and. i == 1 .and. self%per_bolt == 4) call messages%add(severity%warning, &
            counted(n, 'bolt')//' without stiffness ignored (4 numbers each, 7 are needed)', self%record_origin(tokens))
         if (.not. self%check .or. self%per_bolt == 4) cycle
         associate (v => self%record%value)
            geometry%bolts(i) = bolt_type(from=v(1:2), to=v(3:4), stiffness=v(5), pretension=v(6), yield_force=v(7), &
                                          origin=self%record_origin(tokens))
            call self%require(tokens, v(5) > 0, 5, 'must be greater than 0', messages)
            call self%require(tokens, v(7) >= 0, 7, 'must not be negative (0: unlimited)', messages)
            do k = 5, 7
               call self%require(tokens, abs(v(k)) <= largest_value, k, 'must not be larger than '// &
                                 to_string(largest_value), messages)
            end do
         end associate
         if (self%has_no_length() .and. all(self%record%token(1:4) > 0)) call messages%add(severity%error, &
            'bolt '//to_string(i)//': its two ends must differ', self%record_origin(tokens))
      end do
   end subroutine read_bolts

   !> Are both ends of the last record equal?
   pure logical function has_no_length(self)
      class(body_reader_type), intent(in) :: self
      associate (v => self%record%value)
         has_no_length = .not. (abs(v(1) - v(3)) > 0 .or. abs(v(2) - v(4)) > 0)
      end associate
   end function has_no_length

   !> Report too many or too few numbers: the expected count and the place where the file ends.
   subroutine report_count(tokens, header, messages)
      type(token_list_type), intent(in) :: tokens
      type(header_type), intent(in) :: header
      type(diagnostics_type), intent(inout) :: messages
      type(body_reader_type) :: body
      type(geometry_input_type) :: unused
      character(len=:), allocatable :: text
      integer :: k
      integer, parameter :: each(8) = [5, 0, 5, 4, 4, 2, 2, 2]   ! numbers of one line, ...

      associate (counts => header%counts)
         do k = 1, 8
            call report_large_count(tokens, 1 + k, trim(count_names(k)), counts(k), each(k), messages)
         end do
         body%record_reader_type = header%reader
         body%check = .false.
         body%per_bolt = merge(7, 4, geometry_needs(counts, 7) <= tokens%n_numbers)
         call body%read_body(tokens, counts, unused, messages)
         text = ''
         if (body%n_missing > 0) text = body%missing_name//': the file ends here; '
         text = text//'expected '//to_string(geometry_needs(counts, 4))//' numbers'
         if (counts(4) > 0) text = text//' (bolts of 4) or '//to_string(geometry_needs(counts, 7))//' (bolts of 7)'
         text = text//' for '//counted(counts(1), 'line')//', '//counted(counts(3), 'material line')//', '// &
                counted(counts(4), 'bolt')//', '//counted(counts(5), 'fixed line')//' and '// &
                points_text(counts(6:8))//', found '//to_string(tokens%n_numbers)
      end associate
      if (fits_analysis(tokens)) text = text//'; the numbers fit an analysis file: are the files swapped?'
      call messages%add(severity%error, text, tokens%end_origin())
      call report_break(tokens, body%record_reader_type, severity%note, messages)
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
