! SPDX-License-Identifier: MIT
!> Reader of geometry files (.dc, .geo). Format: docs/file-formats.md.
module rockdda_io_geometry_file
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : counted, to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_model_blocks, only : largest_coordinate
   use rockdda_model_geometry_input, only : geometry_input_type, bolt_type
   use rockdda_io_counting, only : geometry_needs, fits_analysis
   use rockdda_io_record_reader, only : record_reader_type, smallest_length, largest_value, append_in_order, &
      note_comment, report_decimal_comma, report_large_count
   use rockdda_io_source, only : source_type
   use rockdda_io_tokens, only : token_list_type, tokenise
   implicit none
   private
   public :: read_geometry_source

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

   !> Reader of e0, the eight counts, and the records behind them.
   type, extends(record_reader_type) :: geometry_reader_type
      real(wp) :: distance = 0                !! e0
      integer :: counts(8) = -1               !! as in count_names
      integer :: per_bolt = 4                 !! numbers of a bolt, one of bolt_sizes
   contains
      procedure :: read_header
      procedure :: read_body
      procedure :: read_lines
      procedure :: read_points
      procedure :: read_bolts
      procedure :: has_no_length
   end type geometry_reader_type

contains

   !> Read and check a geometry file; every problem is added to `messages`. The geometry is valid only when
   !> no error was added.
   subroutine read_geometry_source(source, geometry, messages)
      type(source_type), intent(in) :: source
      type(geometry_input_type), intent(out) :: geometry
      type(diagnostics_type), intent(inout) :: messages
      type(token_list_type), target :: tokens
      type(geometry_reader_type) :: header, reader
      logical :: header_ok, ok
      integer :: way

      call tokenise(source, tokens)
      if (tokens%n == 0) then
         call messages%add(severity%error, 'the file holds no numbers', tokens%end_origin())
         return
      end if
      call header%read_header(tokens, .false., header_ok)
      if (.not. header_ok .and. fits_analysis(tokens)) then
         call messages%add(severity%error, 'the numbers fit an analysis file, not a geometry file: '// &
                           'are the files swapped?', tokens%end_origin())
         return
      end if
      ok = .false.
      do way = 1, 2
         if (ok .or. .not. header_ok) exit
         if (geometry_needs(header%counts, bolt_sizes(way)) /= tokens%n_numbers) cycle
         call read_as(tokens, bolt_sizes(way), .false., geometry, reader, ok)
      end do
      ! the count does not fit, perhaps because of mistyped numbers: find the reading that fits with them
      do way = 1, 4
         if (ok .or. tokens%n_text == 0) exit
         call read_as(tokens, bolt_sizes(2 - modulo(way, 2)), way > 2, geometry, reader, ok)
      end do
      if (.not. ok) call report_misfit(tokens, reader)
      if (reader%messages%has_errors()) call report_decimal_comma(tokens, reader%messages)
      call append_in_order(messages, reader%messages)
   end subroutine read_geometry_source

   !> Read the file with a given number of values per bolt.
   subroutine read_as(tokens, per_bolt, strict, geometry, reader, exact)
      type(token_list_type), intent(in), target :: tokens
      integer, intent(in) :: per_bolt
      logical, intent(in) :: strict
      type(geometry_input_type), intent(inout) :: geometry
      type(geometry_reader_type), intent(out) :: reader
      logical, intent(out) :: exact          !! the file has exactly the numbers that were read
      call reader%read_header(tokens, strict, exact)
      ! counts that exceed the file are refused before memory is allocated
      if (exact) exact = geometry_needs(reader%counts, per_bolt) <= tokens%n
      if (.not. exact) return
      reader%per_bolt = per_bolt
      call reader%read_body(geometry)
      exact = reader%is_exact() .or. reader%too_many_errors()
      geometry%edge_node_distance = reader%distance
      geometry%n_boundary = reader%counts(2)
      call check_distance(reader, maxval(abs(geometry%lines)))
   end subroutine read_as

   !> Report an e0 that is not larger than the rounding of the coordinates.
   subroutine check_distance(reader, largest)
      type(geometry_reader_type), intent(inout) :: reader
      real(wp), intent(in) :: largest        !! coordinate
      type(record_reader_type) :: first
      if (largest > largest_coordinate .or. .not. reader%distance >= smallest_length) return
      if (reader%distance >= smallest_distance*largest) return
      first%tokens => reader%tokens
      call first%read_record([distance_name], '', 0)
      first%messages = reader%messages
      call first%require(.false., 1, 'must be at least '//to_string(smallest_distance)// &
                         ' of the largest coordinate, '//to_string(largest))
      reader%messages = first%messages
   end subroutine check_distance

   !> Find why no reading fits the file.
   subroutine report_misfit(tokens, reader)
      type(token_list_type), intent(in), target :: tokens
      type(geometry_reader_type), intent(out) :: reader
      type(geometry_reader_type) :: strict
      logical :: ok, strict_ok
      call reader%read_header(tokens, .false., ok)
      strict_ok = .true.
      ! a word in place of a count, on a line of its own?
      if (tokens%n_text > 0) call strict%read_header(tokens, .true., strict_ok)
      if (.not. strict_ok .and. (ok .or. strict%messages%n_errors <= reader%messages%n_errors)) then
         reader%messages = strict%messages
      else if (ok) then
         call report_count(reader)
         call note_comment(tokens, reader%messages)
      end if
   end subroutine report_misfit

   !> Read the distance e0 and the eight counts.
   subroutine read_header(self, tokens, strict, ok)
      class(geometry_reader_type), intent(inout) :: self
      type(token_list_type), intent(in), target :: tokens
      logical, intent(in) :: strict
      logical, intent(out) :: ok
      integer :: k
      self%tokens => tokens
      self%strict = strict
      associate (counts => self%counts, distance => self%distance)
         call self%read_record([distance_name], '', 0)
         distance = self%record%value(1)
         call self%require(distance > 0, 1, 'must be greater than 0')
         call self%require(distance >= smallest_length .or. distance <= 0, 1, &
                             'must be at least '//to_string(smallest_length))
         call self%require_size(largest_coordinate)
         do k = 1, 8
            call self%read_count(trim(count_names(k)), counts(k))
            if (k == 2 .and. counts(1) >= 0 .and. counts(2) > counts(1)) then
               call self%require(.false., 1, 'must not be larger than the '//trim(count_names(1))//' ('// &
                                   to_string(counts(1))//')')
               counts(2) = counts(1)
            end if
         end do
         ok = all(counts >= 0)
         if (self%n_missing > 0) then
            call self%messages%add(severity%error, self%missing_name//': the file ends here', tokens%end_origin())
            ok = .false.
         else if (ok .and. counts(1) == 0) then
            call self%messages%add(severity%error, 'the geometry has no lines', tokens%origin(min(2, tokens%n)))
            ok = .false.
         end if
      end associate
   end subroutine read_header

   !> Read all records after the counts, and store them unless they are only counted (check is false).
   subroutine read_body(self, geometry)
      class(geometry_reader_type), intent(inout) :: self
      type(geometry_input_type), intent(inout) :: geometry
      if (self%check) call geometry%allocate_all(self%counts(1), self%counts(3), merge(self%counts(4), 0, &
                                                 self%per_bolt == 7), self%counts(5), self%counts(6), self%counts(7), &
                                                 self%counts(8))
      call self%read_lines('line', self%counts(1), geometry%lines, geometry%line_joint, geometry%line_origin)
      call self%read_lines('material line', self%counts(3), geometry%material_lines, geometry%line_material, &
                           geometry%material_line_origin)
      call self%read_bolts(self%counts(4), geometry)
      call self%read_points('fixed line', end_names, self%counts(5), geometry%fixed_lines, geometry%fixed_origin)
      call self%read_points('loading point', point_names, self%counts(6), geometry%loading_points, &
                            geometry%loading_origin)
      call self%read_points('measured point', point_names, self%counts(7), geometry%measured_points, &
                            geometry%measured_origin)
      call self%read_points('hole point', point_names, self%counts(8), geometry%hole_points, geometry%hole_origin)
   end subroutine read_body

   !> Read lines: both ends and a material number.
   subroutine read_lines(self, object, n, ends, number, origin)
      class(geometry_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: object             !! 'line' or 'material line'
      integer, intent(in) :: n
      real(wp), intent(inout), allocatable :: ends(:, :)
      integer, intent(inout), allocatable :: number(:)   !! of the material
      type(origin_type), intent(inout), allocatable :: origin(:)
      character(len=14) :: names(5)
      integer :: i
      names(1:4) = end_names
      names(5) = merge('joint material', 'block material', object == 'line')
      do i = 1, n
         if (.not. self%goes_on()) return
         call self%read_record(names, object, i)
         call self%require_size(largest_coordinate, 4)
         if (.not. self%check) cycle
         ends(:, i) = self%record%value(1:4)
         number(i) = self%to_whole(5)
         origin(i) = self%record_origin()
         if (object == 'line' .and. self%has_no_length() .and. all(self%record%token(1:4) > 0)) &
            call self%messages%add(severity%warning, 'line '//to_string(i)//' has no length', origin(i))
      end do
   end subroutine read_lines

   !> Read points, or fixed lines with their ends.
   subroutine read_points(self, object, names, n, position, origin)
      class(geometry_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: object, names(:)
      integer, intent(in) :: n
      real(wp), intent(inout), allocatable :: position(:, :)
      type(origin_type), intent(inout), allocatable :: origin(:)
      integer :: i
      do i = 1, n
         if (.not. self%goes_on()) return
         call self%read_record(names, object, i)
         call self%require_size(largest_coordinate)
         if (.not. self%check) cycle
         position(:, i) = self%record%value(1:size(names))
         origin(i) = self%record_origin()
      end do
   end subroutine read_points

   !> Read bolts; those with 4 numbers are ignored.
   subroutine read_bolts(self, n, geometry)
      class(geometry_reader_type), intent(inout) :: self
      integer, intent(in) :: n
      type(geometry_input_type), intent(inout) :: geometry
      integer :: i, k
      do i = 1, n
         if (.not. self%goes_on()) return
         call self%read_record(bolt_names(1:self%per_bolt), 'bolt', i)
         call self%require_size(largest_coordinate, 4)
         if (self%check .and. i == 1 .and. self%per_bolt == 4) call self%messages%add(severity%warning, &
            counted(n, 'bolt')//' without stiffness ignored (4 numbers each, 7 are needed)', self%record_origin())
         if (.not. self%check .or. self%per_bolt == 4) cycle
         associate (v => self%record%value)
            geometry%bolts(i) = bolt_type(from=v(1:2), to=v(3:4), stiffness=v(5), pretension=v(6), yield_force=v(7), &
                                          origin=self%record_origin())
            call self%require(v(5) > 0, 5, 'must be greater than 0')
            call self%require(v(7) >= 0, 7, 'must not be negative (0: unlimited)')
            do k = 5, 7
               call self%require(abs(v(k)) <= largest_value, k, 'must not be larger than '//to_string(largest_value))
            end do
         end associate
         if (self%has_no_length() .and. all(self%record%token(1:4) > 0)) call self%messages%add(severity%error, &
            'bolt '//to_string(i)//': its two ends must differ', self%record_origin())
      end do
   end subroutine read_bolts

   !> Are both ends of the last record equal?
   pure logical function has_no_length(self)
      class(geometry_reader_type), intent(in) :: self
      associate (v => self%record%value)
         has_no_length = .not. (abs(v(1) - v(3)) > 0 .or. abs(v(2) - v(4)) > 0)
      end associate
   end function has_no_length

   !> Report too many or too few numbers: the expected count and the place where the file ends.
   subroutine report_count(reader)
      type(geometry_reader_type), intent(inout) :: reader
      type(geometry_input_type) :: unused
      character(len=:), allocatable :: text
      integer :: k
      integer, parameter :: each(8) = [5, 0, 5, 4, 4, 2, 2, 2]   ! numbers of one line, ...

      associate (counts => reader%counts, tokens => reader%tokens)
         do k = 1, 8
            call report_large_count(tokens, 1 + k, trim(count_names(k)), counts(k), each(k), reader%messages)
         end do
         reader%check = .false.
         reader%per_bolt = merge(7, 4, geometry_needs(counts, 7) <= tokens%n_numbers)
         call reader%read_body(unused)
         text = ''
         if (reader%n_missing > 0) text = reader%missing_name//': the file ends here; '
         text = text//'expected '//to_string(geometry_needs(counts, 4))//' numbers'
         if (counts(4) > 0) text = text//' (bolts of 4) or '//to_string(geometry_needs(counts, 7))//' (bolts of 7)'
         text = text//' for '//counted(counts(1), 'line')//', '//counted(counts(3), 'material line')//', '// &
                counted(counts(4), 'bolt')//', '//counted(counts(5), 'fixed line')//' and '// &
                points_text(counts(6:8))//', found '//to_string(tokens%n_numbers)
      end associate
      if (fits_analysis(reader%tokens)) text = text//'; the numbers fit an analysis file: are the files swapped?'
      call reader%messages%add(severity%error, text, reader%tokens%end_origin())
      call reader%report_break(severity%note)
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
