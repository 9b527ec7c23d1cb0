! SPDX-License-Identifier: MIT
!> Reader of block files (.blk): the format of RockDDA and that of DDA for Windows, recognised by content.
module rockdda_io_block_file
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_blocks, only : block_system_type, bolt_set_type, point_set_type
   use rockdda_io_block_check, only : check_blocks
   use rockdda_io_windows_block_file, only : fits_windows_blocks, read_windows_blocks
   use rockdda_io_row_reader, only : row_reader_type
   use rockdda_io_source, only : source_type
   use rockdda_io_tokens, only : token_list_type, tokenise
   implicit none
   private
   public :: read_block_source, block_file_magic

   !> First word of RockDDA's block files.
   character(len=*), parameter :: block_file_magic = 'rockdda-blocks'
   integer, parameter :: format_version = 1
   !> Reading stops after this number of messages.
   integer, parameter :: most_errors = 1000
   character(len=*), parameter :: one_name(1) = ['value']
   !> The counts of a file: their keywords, the smallest allowed, and the words and numbers that each needs.
   character(len=8), parameter :: count_words(6) = [character(len=8) :: 'blocks', 'vertices', 'fixed', 'loading', &
                                                    'measured', 'bolts']
   integer, parameter :: least_counts(6) = [1, 3, 0, 0, 0, 0], words_each(6) = [4, 3, 3, 3, 3, 9]

   type, extends(row_reader_type) :: block_reader_type
      integer :: n_errors = 0      !! before the blocks
   contains
      procedure :: read_head
      procedure :: read_polygons
      procedure :: read_vertices
      procedure :: read_points
      procedure :: read_number
      procedure :: read_bolts
      procedure :: begin_section
      procedure :: end_section
   end type block_reader_type

contains

   !> Read and check a block file; every problem is added to `messages`. Valid only when no error was added.
   subroutine read_block_source(source, blocks, messages)
      type(source_type), intent(in) :: source
      type(block_system_type), intent(out) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      type(token_list_type) :: tokens
      integer, allocatable :: block_token(:), edge_token(:)
      integer :: n_errors
      n_errors = messages%n_errors
      call tokenise(source, tokens)
      if (tokens%n > 0) then
         if (tokens%text(1) == block_file_magic) then
            call read_own_blocks(tokens, blocks, block_token, edge_token, messages)
         else if (fits_windows_blocks(tokens)) then
            call read_windows_blocks(tokens, blocks, block_token, edge_token, messages)
         else
            call messages%add(severity%error, "this is not a block file: it begins neither with '"// &
                              block_file_magic//"' nor with counts that fit its numbers", tokens%origin(1))
         end if
      else
         call messages%add(severity%error, 'the file holds no blocks', tokens%end_origin())
      end if
      if (messages%n_errors > n_errors) return
      call check_blocks(blocks, tokens, block_token, edge_token, messages)
      blocks%file_line = tokens%line(block_token)
   end subroutine read_block_source

   !> Read the format of RockDDA.
   subroutine read_own_blocks(tokens, blocks, block_token, edge_token, messages)
      type(token_list_type), intent(in), target :: tokens
      type(block_system_type), intent(inout) :: blocks
      integer, allocatable, intent(out) :: block_token(:)  !! (n_blocks) token where each begins
      integer, allocatable, intent(out) :: edge_token(:)   !! (n_vertices) token where the row of each vertex begins
      type(diagnostics_type), intent(inout), target :: messages
      type(block_reader_type) :: reader
      integer :: counts(6)
      logical :: ok
      call reader%start(tokens, messages)
      call reader%read_head(blocks%edge_node_distance, counts, ok)
      if (.not. ok) return
      reader%n_errors = messages%n_errors
      call reader%read_polygons(counts(1), counts(2), blocks, block_token, edge_token)
      call reader%read_points('fixed_points', 'fixed point', counts(3), blocks%fixed)
      call reader%read_points('loading_points', 'loading point', counts(4), blocks%loading)
      call reader%read_points('measured_points', 'measured point', counts(5), blocks%measured)
      call reader%read_bolts(counts(6), counts(1), blocks%bolts)
      if (messages%n_errors > reader%n_errors) return
      call reader%read_row('end', one_name(1:0), 'end of the file')
      if (reader%row_ok .and. reader%at <= reader%n_rows) call messages%add(severity%error, &
         "nothing may follow 'end'", tokens%origin(reader%first(reader%at)))
   end subroutine read_own_blocks

   !> Format version, e0 and the counts; ok is false when the rest cannot be read.
   subroutine read_head(self, distance, counts, ok)
      class(block_reader_type), intent(inout) :: self
      real(wp), intent(out) :: distance
      integer, intent(out) :: counts(6)               !! as in count_words
      logical, intent(out) :: ok
      character(len=:), allocatable :: name
      integer(i8) :: needed
      integer :: version, k
      ok = .false.
      distance = 0
      counts = least_counts
      call self%read_row(block_file_magic, ['version'], 'first line')
      version = self%whole(1, 1, 'format version')
      if (.not. self%row_ok) return
      if (version > format_version) then
         call self%fail(1, 'format version: this program reads version '//to_string(format_version))
         return
      end if
      call self%read_row('e0', one_name, 'minimum edge-node distance')
      if (.not. self%row_ok) return
      distance = self%value(1)
      if (distance < 0) call self%fail(1, 'e0: must not be negative')
      do k = 1, 6
         name = 'number of '//trim(count_words(k))
         call self%read_row(trim(count_words(k)), one_name, name)
         if (self%row_ok) counts(k) = self%whole(1, least_counts(k), name)
         if (.not. self%row_ok) return
      end do
      ! counts that exceed the file are refused before memory is allocated
      needed = sum(int(counts, i8)*words_each)
      ok = needed <= self%tokens%n
      if (ok) return
      k = maxloc(int(counts, i8)*words_each, dim=1)
      call self%messages%add(severity%error, 'the counts at the beginning need '//to_string(needed)// &
                             ' words and numbers, the file has '//to_string(self%tokens%n)//'; '// &
                             trim(count_words(k))//' '//to_string(counts(k))//' seems to be wrong', &
                             self%tokens%end_origin())
   end subroutine read_head

   !> Read all blocks with their vertices.
   subroutine read_polygons(self, n_blocks, n_vertices, blocks, block_token, edge_token)
      class(block_reader_type), intent(inout) :: self
      integer, intent(in) :: n_blocks, n_vertices
      type(block_system_type), intent(inout) :: blocks
      integer, allocatable, intent(out) :: block_token(:), edge_token(:)
      character(len=8), parameter :: names(3) = [character(len=8) :: 'number', 'material', 'vertices']
      character(len=:), allocatable :: name
      integer :: i, n, last
      allocate (blocks%vertex_offset(n_blocks + 1), blocks%block_material(n_blocks), block_token(n_blocks), &
                blocks%edge_joint(n_vertices), edge_token(n_vertices), source=0)
      allocate (blocks%vertices(2, n_vertices), source=0.0_wp)
      blocks%n_blocks = n_blocks
      last = 0
      do i = 1, n_blocks
         if (self%messages%n_errors > most_errors) return
         name = 'block '//to_string(i)
         call self%read_row('block', names, name)
         if (.not. self%row_ok) then
            call self%skip_to_keyword()
            if (self%keyword() /= 'block') return
            cycle
         end if
         block_token(i) = self%first(self%row)
         if (self%whole(1, 1, 'number of '//name) /= i) &
            call self%fail(1, 'number of '//name//': expected '//to_string(i))
         blocks%block_material(i) = self%whole(2, 1, 'material of '//name)
         n = self%whole(3, 3, 'number of vertices of '//name)
         if (n > n_vertices - last) then
            call self%fail(3, 'vertices of '//name//': the file announces '//to_string(n_vertices)// &
                           ' vertices in all, '//to_string(n_vertices - last)//' are left')
            call self%skip_to_keyword()
            cycle
         end if
         call self%read_vertices(name, last, n, blocks, edge_token)
         last = last + n
         blocks%vertex_offset(i + 1) = last
      end do
      if (last /= n_vertices .and. .not. self%messages%has_errors()) call self%messages%add(severity%error, &
         'the blocks have '//to_string(last)//' vertices, the beginning of the file announces '// &
         to_string(n_vertices), self%tokens%end_origin())
   end subroutine read_polygons

   !> Read the n vertices of a block, stored after the first `skip`.
   subroutine read_vertices(self, name, skip, n, blocks, edge_token)
      class(block_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: name            !! of the block
      integer, intent(in) :: skip, n
      type(block_system_type), intent(inout) :: blocks
      integer, intent(inout) :: edge_token(:)
      character(len=14), parameter :: names(3) = [character(len=14) :: 'x', 'y', 'joint material']
      character(len=:), allocatable :: vertex
      integer :: k
      do k = skip + 1, skip + n
         vertex = 'vertex '//to_string(k - skip)//' of '//name
         call self%read_row('', names, vertex)
         if (.not. self%row_ok .and. len(self%keyword()) > 0) exit
         edge_token(k) = self%first(self%row)
         blocks%vertices(:, k) = self%value(1:2)
         blocks%edge_joint(k) = self%whole(3, 0, 'joint material of '//vertex)
      end do
      if (self%at > self%n_rows .or. len(self%keyword()) > 0) return
      call self%messages%add(severity%error, name//': more vertices than the '//to_string(n)//' announced', &
                        self%tokens%origin(self%first(self%at)))
      call self%skip_to_keyword()
   end subroutine read_vertices

   !> Read one section of points. Rows of measured points may end with the number of the input.
   subroutine read_points(self, word, object, n, points)
      class(block_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: word, object
      integer, intent(in) :: n
      type(point_set_type), intent(inout) :: points
      character(len=6), parameter :: names(4) = [character(len=6) :: 'x', 'y', 'block', 'number']
      character(len=:), allocatable :: name
      integer :: k
      logical :: ok
      points%n = n
      allocate (points%position(2, n), points%block(n), points%origin(n))
      points%position = 0
      points%block = 0
      points%number = [(k, k=1, n)]
      call self%begin_section(word, ok)
      if (.not. ok) return
      do k = 1, n
         name = object//' '//to_string(k)
         call self%read_row('', names(1:3), name, optional_names=names(4:merge(4, 3, word == 'measured_points')))
         if (.not. self%row_ok) then
            if (len(self%keyword()) > 0 .or. self%at > self%n_rows) return
            cycle
         end if
         points%position(:, k) = self%value(1:2)
         points%block(k) = self%whole(3, 1, 'block of '//name)
         points%origin(k) = self%place(0)
         call self%read_number(name, k, points%number)
      end do
      call self%end_section(word)
   end subroutine read_points

   !> Read the number of point k at the end of the row, if there is one; numbers must increase.
   subroutine read_number(self, name, k, number)
      class(block_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: name            !! of the point
      integer, intent(in) :: k
      integer, intent(inout) :: number(:)             !! of all points
      integer :: before, n_before
      before = 0
      if (k > 1) before = number(k - 1)
      if (self%token(4) > 0) then
         n_before = self%messages%n_errors
         number(k) = self%whole(4, 1, 'number of '//name)
         if (number(k) <= before .and. self%messages%n_errors == n_before) call self%fail(4, &
            'number of '//name//': numbers must increase, the point before has '//to_string(before))
      else if (k <= before) then
         call self%messages%add(severity%error, name//': needs a number above '//to_string(before)// &
                           ', that of the point before', self%place(0))
      end if
   end subroutine read_number

   !> Read the section of bolts.
   subroutine read_bolts(self, n, n_blocks, bolts)
      class(block_reader_type), intent(inout) :: self
      integer, intent(in) :: n, n_blocks
      type(bolt_set_type), intent(inout) :: bolts
      character(len=10), parameter :: names(9) = [character(len=10) :: 'x1', 'y1', 'x2', 'y2', 'block 1', &
                                                  'block 2', 'stiffness', 'pretension', 'strength']
      character(len=:), allocatable :: name
      integer :: k, side
      logical :: ok
      bolts%n = n
      allocate (bolts%ends(4, n), bolts%blocks(2, n), bolts%stiffness(n), bolts%pretension(n), bolts%strength(n))
      bolts%blocks = 0
      call self%begin_section('bolt_list', ok)
      if (.not. ok) return
      do k = 1, n
         name = 'bolt '//to_string(k)
         call self%read_row('', names, name)
         if (.not. self%row_ok) then
            if (len(self%keyword()) > 0 .or. self%at > self%n_rows) return
            cycle
         end if
         bolts%ends(:, k) = self%value(1:4)
         bolts%blocks(1, k) = self%whole(5, 0, 'first block of '//name)
         bolts%blocks(2, k) = self%whole(6, 0, 'second block of '//name)
         bolts%stiffness(k) = self%value(7)
         bolts%pretension(k) = self%value(8)
         bolts%strength(k) = self%value(9)
         do side = 1, 2
            if (bolts%blocks(side, k) > n_blocks) call self%fail(4 + side, trim(names(4 + side))// &
               ' of '//name//': must be between 0 and '//to_string(n_blocks))
         end do
         if (.not. bolts%stiffness(k) > 0) call self%fail(7, 'stiffness of '//name//': must be greater than 0')
         if (bolts%strength(k) < 0) call self%fail(9, 'strength of '//name//': must not be negative (0: unlimited)')
      end do
      call self%end_section('bolt_list')
   end subroutine read_bolts

   !> Read the keyword of a section. At the end of a file that has errors already none is added.
   subroutine begin_section(self, word, ok)
      class(block_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: word
      logical, intent(out) :: ok                      !! its rows follow
      ok = .false.
      if (self%at > self%n_rows .and. self%messages%n_errors > self%n_errors) return
      call self%read_row(word, one_name(1:0), 'section '//word)
      ok = self%row_ok
   end subroutine begin_section

   !> Report rows of numbers that are left before the next section.
   subroutine end_section(self, word)
      class(block_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: word
      if (self%at > self%n_rows .or. len(self%keyword()) > 0) return
      call self%messages%add(severity%error, 'section '//word//' has more rows than announced', &
                        self%tokens%origin(self%first(self%at)))
      call self%skip_to_keyword()
   end subroutine end_section

end module rockdda_io_block_file
