! SPDX-License-Identifier: MIT
!> Check across files that the materials of the model exist in the analysis file.
module rockdda_check_materials
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_base_numbers, only : number_status, parse_number
   implicit none
   private
   public :: check_geometry_materials, check_block_materials

   !> Checking stops after this number of messages.
   integer, parameter :: most_errors = 1000

contains

   !> Materials named in a geometry file; errors show the line that names them.
   subroutine check_geometry_materials(geometry, n_block, n_joint, messages)
      type(geometry_input_type), intent(in) :: geometry
      integer, intent(in) :: n_block, n_joint      !! block and joint materials, with those that options add
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      do i = 1, size(geometry%line_joint)
         if (messages%n_errors >= most_errors) return
         if (geometry%line_joint(i) > n_joint) call messages%add(severity%error, 'joint material of line '// &
            to_string(i)//': '//unknown('joint', geometry%line_joint(i), n_joint), &
            fifth_number(geometry%line_origin(i)))
      end do
      do i = 1, size(geometry%line_material)
         if (messages%n_errors >= most_errors) return
         if (geometry%line_material(i) > n_block) call messages%add(severity%error, &
            'block material of material line '//to_string(i)//': '// &
            unknown('block', geometry%line_material(i), n_block), fifth_number(geometry%material_line_origin(i)))
      end do
   end subroutine check_geometry_materials

   !> Materials of a cut model.
   subroutine check_block_materials(blocks, n_block, n_joint, file, messages)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: n_block, n_joint      !! block and joint materials, with those that options add
      character(len=*), intent(in) :: file         !! file of the blocks, for messages
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type) :: origin
      integer :: i, k
      origin%file = file
      do i = 1, blocks%n_blocks
         if (messages%n_errors >= most_errors) return
         if (allocated(blocks%file_line)) then
            origin%line = blocks%file_line(i)
            origin%column = 1
         end if
         if (blocks%block_material(i) > n_block) call messages%add(severity%error, 'material of block '// &
            to_string(i)//': '//unknown('block', blocks%block_material(i), n_block), origin)
         do k = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            if (blocks%edge_joint(k) > n_joint) call messages%add(severity%error, 'joint material of edge '// &
               to_string(k - blocks%vertex_offset(i))//' of block '//to_string(i)//': '// &
               unknown('joint', blocks%edge_joint(k), n_joint), origin)
         end do
      end do
   end subroutine check_block_materials

   !> "3 is not among the 2 joint materials of the analysis file".
   pure function unknown(what, number, count) result(text)
      character(len=*), intent(in) :: what
      integer, intent(in) :: number, count
      character(len=:), allocatable :: text
      if (count == 1) then
         text = to_string(number)//' is unknown, the analysis file has 1 '//what//' material'
      else
         text = to_string(number)//' is unknown, the analysis file has '//to_string(count)//' '//what//' materials'
      end if
   end function unknown

   !> The place of the fifth number from an origin on, when it stands on the same line; the origin otherwise.
   pure function fifth_number(start) result(origin)
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

end module rockdda_check_materials
