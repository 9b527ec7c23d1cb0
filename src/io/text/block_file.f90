! SPDX-License-Identifier: MIT
!> Reader of block files (.blk): the format of RockDDA and that of DDA for Windows, recognised by content.
module rockdda_io_block_file
   use rockdda_base_kinds, only : i8
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_blocks, only : block_system_type, point_set_type
   use rockdda_io_block_check, only : check_blocks
   use rockdda_io_peer_block_file, only : fits_peer_blocks, read_peer_blocks
   use rockdda_io_row_reader, only : row_reader_type
   use rockdda_io_source, only : source_type, read_source
   use rockdda_io_tokens, only : token_list_type, tokenise
   implicit none
   private
   public :: read_block_file, read_block_source, block_file_magic

   !> First word of RockDDA's block files.
   character(len=*), parameter :: block_file_magic = 'rockdda-blocks'
   integer, parameter :: format_version = 1
   !> Reading stops after this number of messages.
   integer, parameter :: most_errors = 1000
   character(len=*), parameter :: one_name(1) = ['value']

contains

   !> Read and check a block file; every problem is added to `messages`. Valid only when no error was added.
   subroutine read_block_file(path, blocks, messages)
      character(len=*), intent(in) :: path
      type(block_system_type), intent(out) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      logical :: ok
      call read_source(path, source, messages, ok)
      if (ok) call read_block_source(source, blocks, messages)
   end subroutine read_block_file

   !> As read_block_file, from text in memory.
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
         else if (fits_peer_blocks(tokens)) then
            call read_peer_blocks(tokens, blocks, block_token, edge_token, messages)
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

   !> The format of RockDDA.
   subroutine read_own_blocks(tokens, blocks, block_token, edge_token, messages)
      type(token_list_type), intent(in) :: tokens
      type(block_system_type), intent(inout) :: blocks
      integer, allocatable, intent(out) :: block_token(:)  !! (n_blocks) token where each begins
      integer, allocatable, intent(out) :: edge_token(:)   !! (n_vertices) token where the row of each vertex begins
      type(diagnostics_type), intent(inout) :: messages
      type(row_reader_type) :: reader
      integer :: n_blocks, n_vertices, n_points(3), n_bolts, version, n_errors

      call reader%start(tokens)
      call reader%read_row(tokens, block_file_magic, ['version'], 'first line', messages)
      version = reader%whole(tokens, 1, 1, 'format version', messages)
      if (.not. reader%row_ok) return
      if (version > format_version) then
         call reader%fail(tokens, 1, 'format version: this program reads version '//to_string(format_version), messages)
         return
      end if
      call reader%read_row(tokens, 'e0', one_name, 'minimum edge-node distance', messages)
      if (.not. reader%row_ok) return
      blocks%edge_node_distance = reader%value(1)
      if (blocks%edge_node_distance < 0) call reader%fail(tokens, 1, 'e0: must not be negative', messages)
      if (.not. count_row('blocks', 1, n_blocks)) return
      if (.not. count_row('vertices', 3, n_vertices)) return
      if (.not. count_row('fixed', 0, n_points(1))) return
      if (.not. count_row('loading', 0, n_points(2))) return
      if (.not. count_row('measured', 0, n_points(3))) return
      if (.not. count_row('bolts', 0, n_bolts)) return
      ! counts that exceed the file are refused before memory is allocated
      if (4_i8*n_blocks + 3_i8*n_vertices + 3*sum(int(n_points, i8)) + 9_i8*n_bolts > tokens%n) then
         call messages%add(severity%error, 'the counts at the beginning ask for '//to_string(4_i8*n_blocks + &
            3_i8*n_vertices + 3*sum(int(n_points, i8)) + 9_i8*n_bolts)//' words and numbers, the file has '// &
            to_string(tokens%n)//'; '//largest_count()//' looks wrong', tokens%end_origin())
         return
      end if
      n_errors = messages%n_errors
      call read_polygons()
      call read_points('fixed_points', 'fixed point', n_points(1), .false., blocks%fixed)
      call read_points('loading_points', 'loading point', n_points(2), .false., blocks%loading)
      call read_points('measured_points', 'measured point', n_points(3), .true., blocks%measured)
      call read_bolts()
      if (messages%n_errors > n_errors) return
      call reader%read_row(tokens, 'end', one_name(1:0), 'end of the file', messages)
      if (reader%row_ok .and. reader%at <= reader%n_rows) call messages%add(severity%error, &
         "nothing may follow 'end'", tokens%origin(reader%first(reader%at)))

   contains

      !> The count that needs the most numbers.
      function largest_count() result(text)
         character(len=:), allocatable :: text
         character(len=*), parameter :: names(6) = [character(len=8) :: 'blocks', 'vertices', 'fixed', 'loading', &
                                                    'measured', 'bolts']
         integer :: counts(6), k
         counts = [n_blocks, n_vertices, n_points, n_bolts]
         k = maxloc(int(counts, i8)*[4, 3, 3, 3, 3, 9], dim=1)
         text = trim(names(k))//' '//to_string(counts(k))
      end function largest_count

      !> A keyword with a count.
      logical function count_row(word, least, count)
         character(len=*), intent(in) :: word
         integer, intent(in) :: least
         integer, intent(out) :: count
         call reader%read_row(tokens, word, one_name, 'number of '//word, messages)
         count = least
         if (reader%row_ok) count = reader%whole(tokens, 1, least, 'number of '//word, messages)
         count_row = reader%row_ok
      end function count_row

      !> All blocks with their vertices.
      subroutine read_polygons()
         character(len=8), parameter :: block_names(3) = [character(len=8) :: 'number', 'material', 'vertices']
         character(len=14), parameter :: vertex_names(3) = [character(len=14) :: 'x', 'y', 'joint material']
         character(len=:), allocatable :: name, vertex
         integer :: i, k, n, last
         allocate (blocks%vertex_offset(n_blocks + 1), blocks%block_material(n_blocks), block_token(n_blocks), &
                   blocks%edge_joint(n_vertices), edge_token(n_vertices), source=0)
         allocate (blocks%vertices(2, n_vertices))
         blocks%vertices = 0
         blocks%n_blocks = n_blocks
         last = 0
         do i = 1, n_blocks
            if (messages%n_errors > most_errors) return
            name = 'block '//to_string(i)
            call reader%read_row(tokens, 'block', block_names, name, messages)
            if (.not. reader%row_ok) then
               call reader%skip_to_keyword(tokens)
               if (reader%keyword(tokens) /= 'block') return
               cycle
            end if
            block_token(i) = reader%first(reader%row)
            if (reader%whole(tokens, 1, 1, 'number of '//name, messages) /= i) &
               call reader%fail(tokens, 1, 'number of '//name//': expected '//to_string(i), messages)
            blocks%block_material(i) = reader%whole(tokens, 2, 1, 'material of '//name, messages)
            n = reader%whole(tokens, 3, 3, 'number of vertices of '//name, messages)
            if (n > n_vertices - last) then
               call reader%fail(tokens, 3, 'vertices of '//name//': the file announces '//to_string(n_vertices)// &
                                ' vertices in all, '//to_string(n_vertices - last)//' are left', messages)
               call reader%skip_to_keyword(tokens)
               cycle
            end if
            do k = last + 1, last + n
               vertex = 'vertex '//to_string(k - last)//' of '//name
               call reader%read_row(tokens, '', vertex_names, vertex, messages)
               if (.not. reader%row_ok .and. len(reader%keyword(tokens)) > 0) exit
               edge_token(k) = reader%first(reader%row)
               blocks%vertices(:, k) = reader%value(1:2)
               blocks%edge_joint(k) = reader%whole(tokens, 3, 0, 'joint material of '//vertex, messages)
            end do
            last = last + n
            blocks%vertex_offset(i + 1) = last
            if (reader%at <= reader%n_rows .and. len(reader%keyword(tokens)) == 0) then
               call messages%add(severity%error, name//': more vertices than the '//to_string(n)//' announced', &
                                 tokens%origin(reader%first(reader%at)))
               call reader%skip_to_keyword(tokens)
            end if
         end do
         if (last /= n_vertices .and. .not. messages%has_errors()) call messages%add(severity%error, &
            'the blocks have '//to_string(last)//' vertices, the beginning of the file announces '// &
            to_string(n_vertices), tokens%end_origin())
      end subroutine read_polygons

      !> One section of points.
      subroutine read_points(word, object, n, numbered, points)
         character(len=*), intent(in) :: word, object
         integer, intent(in) :: n
         logical, intent(in) :: numbered                 !! rows may end with the number of the input
         type(point_set_type), intent(inout) :: points
         character(len=6), parameter :: names(4) = [character(len=6) :: 'x', 'y', 'block', 'number']
         character(len=:), allocatable :: name
         integer :: k, before, n_before
         points%n = n
         allocate (points%position(2, n), points%block(n), points%origin(n), points%number(n))
         points%position = 0
         points%block = 0
         points%number = [(k, k=1, n)]
         if (reader%at > reader%n_rows .and. messages%n_errors > n_errors) return  ! said once
         call reader%read_row(tokens, word, one_name(1:0), 'section '//word, messages)
         if (.not. reader%row_ok) return
         do k = 1, n
            name = object//' '//to_string(k)
            call reader%read_row(tokens, '', names(1:3), name, messages, optional_names=names(4:merge(4, 3, numbered)))
            if (.not. reader%row_ok) then
               if (len(reader%keyword(tokens)) > 0 .or. reader%at > reader%n_rows) return
               cycle
            end if
            points%position(:, k) = reader%value(1:2)
            points%block(k) = reader%whole(tokens, 3, 1, 'block of '//name, messages)
            points%origin(k) = reader%place(tokens, 0)
            before = 0
            if (k > 1) before = points%number(k - 1)
            if (reader%token(4) > 0) then
               n_before = messages%n_errors
               points%number(k) = reader%whole(tokens, 4, 1, 'number of '//name, messages)
               if (points%number(k) <= before .and. messages%n_errors == n_before) call reader%fail(tokens, 4, &
                  'number of '//name//': numbers must increase, the point before has '//to_string(before), messages)
            else if (k <= before) then
               call messages%add(severity%error, name//': needs a number above '//to_string(before)// &
                                 ', that of the point before', reader%place(tokens, 0))
            end if
         end do
         call end_section(word)
      end subroutine read_points

      !> The section of bolts.
      subroutine read_bolts()
         character(len=10), parameter :: names(9) = [character(len=10) :: 'x1', 'y1', 'x2', 'y2', 'block 1', &
                                                     'block 2', 'stiffness', 'pretension', 'strength']
         character(len=:), allocatable :: name
         integer :: k, side
         associate (bolts => blocks%bolts)
            bolts%n = n_bolts
            allocate (bolts%ends(4, n_bolts), bolts%blocks(2, n_bolts), bolts%stiffness(n_bolts), &
                      bolts%pretension(n_bolts), bolts%strength(n_bolts))
            bolts%blocks = 0
            if (reader%at > reader%n_rows .and. messages%n_errors > n_errors) return
            call reader%read_row(tokens, 'bolt_list', one_name(1:0), 'section bolt_list', messages)
            if (.not. reader%row_ok) return
            do k = 1, n_bolts
               name = 'bolt '//to_string(k)
               call reader%read_row(tokens, '', names, name, messages)
               if (.not. reader%row_ok) then
                  if (len(reader%keyword(tokens)) > 0 .or. reader%at > reader%n_rows) return
                  cycle
               end if
               bolts%ends(:, k) = reader%value(1:4)
               bolts%blocks(1, k) = reader%whole(tokens, 5, 0, 'first block of '//name, messages)
               bolts%blocks(2, k) = reader%whole(tokens, 6, 0, 'second block of '//name, messages)
               bolts%stiffness(k) = reader%value(7)
               bolts%pretension(k) = reader%value(8)
               bolts%strength(k) = reader%value(9)
               do side = 1, 2
                  if (bolts%blocks(side, k) > n_blocks) call reader%fail(tokens, 4 + side, trim(names(4 + side))// &
                     ' of '//name//': must be between 0 and '//to_string(n_blocks), messages)
               end do
               if (.not. bolts%stiffness(k) > 0) call reader%fail(tokens, 7, 'stiffness of '//name// &
                                                                  ': must be greater than 0', messages)
               if (bolts%strength(k) < 0) call reader%fail(tokens, 9, 'strength of '//name// &
                                                           ': must not be negative (0: unlimited)', messages)
            end do
         end associate
         call end_section('bolt_list')
      end subroutine read_bolts

      !> No rows of numbers may be left before the next section.
      subroutine end_section(word)
         character(len=*), intent(in) :: word
         if (reader%at > reader%n_rows .or. len(reader%keyword(tokens)) > 0) return
         call messages%add(severity%error, 'section '//word//' has more rows than announced', &
                           tokens%origin(reader%first(reader%at)))
         call reader%skip_to_keyword(tokens)
      end subroutine end_section

   end subroutine read_own_blocks

end module rockdda_io_block_file
