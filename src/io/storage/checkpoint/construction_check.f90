! SPDX-License-Identifier: MIT
!> Validate what a checkpoint says of stages that build: see rockdda_io_checkpoint_model_check.
module rockdda_io_construction_check
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_stepping_construction, only : construction_type
   use rockdda_base_value_check, only : value_check_type
   implicit none
   private
   public :: construction_problem

contains

   !> Blocks of stages and changes.
   function construction_problem(blocks, p, construction) result(problem)
      type(block_system_type), intent(in) :: blocks      !! checked
      type(parameters_type), intent(in) :: p             !! checked
      type(construction_type), intent(in) :: construction
      character(len=:), allocatable :: problem
      type(value_check_type) :: check
      integer :: nb
      nb = blocks%n_blocks
      check%group = 'construction'
      call check_masks(check, construction%excavated, nb, size(p%stages), 'excavated')
      call check_masks(check, construction%placed, nb, size(p%stages), 'placed')
      call check_masks(check, construction%changed, nb, size(p%changes), 'changed')
      call check%is_there(allocated(construction%newborn), 'newborn')
      if (check%passed()) call check%has_shape(size(construction%newborn) == nb, 'newborn')
      problem = check%problem()
   end function construction_problem

   !> A table of 0 and 1, a column for each stage or change.
   subroutine check_masks(check, masks, nb, n, name)
      type(value_check_type), intent(inout) :: check
      integer, allocatable, intent(in) :: masks(:, :)
      integer, intent(in) :: nb, n
      character(len=*), intent(in) :: name
      call check%is_there(allocated(masks), name)
      if (.not. allocated(masks)) return
      call check%has_shape(size(masks, 1) == nb .and. size(masks, 2) == n, name)
      call check%in_range(reshape(masks, [size(masks)]), 0, 1, name)
   end subroutine check_masks

end module rockdda_io_construction_check
