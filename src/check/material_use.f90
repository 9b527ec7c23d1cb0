! SPDX-License-Identifier: MIT
!> Materials that the geometry uses and nothing describes, no analysis file and no options: one error for each number,
!> where it is first used.
module rockdda_check_material_use
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_kinds, only : wp
   use rockdda_base_numbers, only : number_status, parse_number
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   implicit none
   private
   public :: check_lines_described, check_blocks_described

contains

   !> Materials that the lines of a geometry name. Blocks without a material line have material 1.
   subroutine check_lines_described(geometry, blocks, blocks_described, joints_described, in_analysis, file, messages)
      type(geometry_input_type), intent(in) :: geometry
      type(block_system_type), intent(in) :: blocks                     !! cut from it; none: not known
      logical, intent(in) :: blocks_described(:), joints_described(:)   !! by number
      logical, intent(in) :: in_analysis                                !! an analysis file describes materials
      character(len=*), intent(in) :: file                              !! of the model, for messages
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type) :: origin
      integer :: i
      call check('joint', 'line', geometry%line_joint, joints_described, in_analysis, &
                 fifth_number(geometry%line_origin), messages)
      call check('block', 'material line', geometry%line_material, blocks_described, in_analysis, &
                 fifth_number(geometry%material_line_origin), messages)
      if (in_analysis .or. blocks%n_blocks == 0 .or. any(geometry%line_material == 1)) return
      if (size(blocks_described) > 0) then
         if (blocks_described(1)) return
      end if
      do i = 1, blocks%n_blocks
         if (blocks%block_material(i) == 1) exit
      end do
      if (i > blocks%n_blocks) return
      origin%file = file
      call messages%add(severity%error, 'block material 1, used by block '//to_string(i)//' and all others without '// &
                        'a material line, is not described: add &block_material number = 1, ... /', origin)
   end subroutine check_lines_described

   !> Materials of the blocks of a block file, and of their edges.
   subroutine check_blocks_described(blocks, blocks_described, joints_described, in_analysis, file, messages)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: blocks_described(:), joints_described(:)   !! by number
      logical, intent(in) :: in_analysis                                !! an analysis file describes materials
      character(len=*), intent(in) :: file                              !! of the model, for messages
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type), allocatable :: origin(:)
      integer, allocatable :: block_of(:)
      integer :: i
      allocate (origin(blocks%n_blocks), block_of(blocks%n_vertices()))
      do i = 1, blocks%n_blocks
         origin(i)%file = file
         block_of(blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)) = i
         if (.not. allocated(blocks%file_line)) cycle
         origin(i)%line = blocks%file_line(i)
         origin(i)%column = 1
      end do
      call check('joint', 'edge', blocks%edge_joint, joints_described, in_analysis, origin(block_of), messages)
      call check('block', 'block', blocks%block_material, blocks_described, in_analysis, origin, messages)
   end subroutine check_blocks_described

   !> One error for each number that is used and not described. Joint material 0 is that of bridges, which need none.
   subroutine check(what, user, used, described, in_analysis, origin, messages)
      character(len=*), intent(in) :: what, user     !! 'joint' or 'block'; 'line', 'edge', 'block'
      integer, intent(in) :: used(:)                 !! numbers
      logical, intent(in) :: described(:), in_analysis
      type(origin_type), intent(in) :: origin(:)     !! of the users
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: others, hint
      logical, allocatable :: missing(:)
      integer :: i, n
      allocate (missing(size(used)))
      missing = used > size(described)
      do i = 1, size(used)
         if (used(i) >= 1 .and. used(i) <= size(described)) missing(i) = .not. described(used(i))
      end do
      do i = 1, size(used)
         if (.not. missing(i)) cycle
         n = count(used == used(i)) - 1
         others = ''
         if (n > 0) others = ' (and by '//to_string(n)//' more)'
         hint = 'add &'//what//'_material number = '//to_string(used(i))//', ... /'
         if (in_analysis) hint = 'the analysis file has '//counted(size(described), what//' material')
         call messages%add(severity%error, what//' material '//to_string(used(i))//', used by '//user//' '// &
                           to_string(i)//others//', is not described: '//hint, origin(i))
         where (used == used(i)) missing = .false.
      end do
   end subroutine check

   !> The place of the fifth number from an origin on, when it stands on the same line; the origin otherwise.
   elemental function fifth_number(start) result(origin)
      type(origin_type), intent(in) :: start
      type(origin_type) :: origin
      character(len=*), parameter :: separators = ' ,'//achar(9)
      integer :: first, last, n
      origin = start
      if (.not. allocated(start%text) .or. start%column < 1) return
      first = start%column
      do n = 1, 5
         if (first > len(start%text)) return
         last = scan(start%text(first:), separators//'#!') + first - 2
         if (last < first) last = len(start%text)
         if (.not. is_number(start%text(first:last))) return
         if (n == 5) exit
         if (last == len(start%text)) return
         first = last + verify(start%text(last + 1:), separators)
         if (first == last) return
      end do
      origin%column = first
   end function fifth_number

   !> Is this a number?
   pure logical function is_number(text)
      character(len=*), intent(in) :: text
      real(wp) :: value
      integer :: status
      call parse_number(text, value, status)
      is_number = status == number_status%ok
   end function is_number

end module rockdda_check_material_use
