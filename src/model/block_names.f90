! SPDX-License-Identifier: MIT
!> Names of blocks in messages: segments of linings are blocks behind those of the model, whose numbers are internal.
module rockdda_model_block_names
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_liner_layout, only : title_of_liner
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: block_name, with_block_names

contains

   !> 'block 7', or "segment 3 of lining 'shotcrete'".
   pure function block_name(blocks, parameters, block) result(name)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: block
      character(len=:), allocatable :: name
      integer :: first, k
      name = 'block '//to_string(block)
      if (block <= blocks%n_blocks - blocks%n_segments .or. block > blocks%n_blocks) return
      k = blocks%block_material(block) - parameters%first_liner_material
      if (.not. allocated(parameters%liners)) return
      if (k < 1 .or. k > size(parameters%liners)) return
      first = findloc(blocks%block_material(1:blocks%n_blocks), blocks%block_material(block), 1)
      name = 'segment '//to_string(block - first + 1)//" of lining '"//title_of_liner(parameters%liners(k), k)//"'"
   end function block_name

   !> A text that speaks of blocks by their numbers, with the names of segments.
   pure function with_block_names(text, blocks, parameters) result(named)
      character(len=*), intent(in) :: text
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      character(len=:), allocatable :: named
      character(len=*), parameter :: word = 'block '
      integer :: at, last, number, status
      named = ''
      last = 0
      do
         at = index(text(last + 1:), word)
         if (at == 0) exit
         named = named//text(last + 1:last + at - 1)
         at = last + at + len(word)
         last = at - 1 + verify(text(at:)//' ', '0123456789') - 1
         status = 1
         if (last >= at) read (text(at:last), *, iostat=status) number
         if (status == 0) then
            named = named//block_name(blocks, parameters, number)
         else
            last = at - 1
            named = named//word
         end if
      end do
      named = named//text(last + 1:)
   end function with_block_names

end module rockdda_model_block_names
