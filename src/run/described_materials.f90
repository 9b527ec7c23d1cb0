! SPDX-License-Identifier: MIT
!> Materials that files describe, and whether they are those of the model.
module rockdda_run_described_materials
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_model_material_names, only : described_materials
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_given_materials, only : put_materials_together
   use rockdda_check_materials, only : check_geometry_materials, check_block_materials
   use rockdda_check_material_use, only : check_lines_described, check_blocks_described
   use rockdda_io_recognise, only : file_kind
   use rockdda_run_input, only : model_input_type
   use rockdda_check_options, only : check_joints
   implicit none
   private
   public :: check_materials, check_laws, find_described

contains

   !> Which materials are described, by their numbers.
   subroutine find_described(input, blocks, joints)
      type(model_input_type), intent(in) :: input
      logical, allocatable, intent(out) :: blocks(:), joints(:)
      integer :: n(2)
      n = 0
      if (allocated(input%analysis%block_materials)) n = [size(input%analysis%block_materials), &
                                                          size(input%analysis%joint_materials)]
      allocate (blocks, source=described_materials(n(1), input%options%block_materials, input%labelled))
      allocate (joints, source=described_materials(n(2), input%options%joint_materials, input%labelled))
   end subroutine find_described

   !> Check that the materials of the model are described.
   subroutine check_materials(input, messages)
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(inout) :: messages
      logical, allocatable :: blocks(:), joints(:)      !! described, by number
      logical :: has_lines, by_options
      call find_described(input, blocks, joints)
      has_lines = input%model_kind == file_kind%geometry .and. allocated(input%geometry%line_joint)
      ! all of them in the options, none in an analysis file
      by_options = input%labelled
      if (allocated(input%analysis%block_materials)) by_options = by_options .and. &
                                                                  size(input%analysis%block_materials) == 0
      if (by_options .and. has_lines) then
         call check_lines_described(input%geometry, input%blocks, blocks, joints, input%model_file, messages)
      else if (by_options .and. input%has_blocks) then
         call check_blocks_described(input%blocks, blocks, joints, input%model_file, messages)
      else if (has_lines) then
         call check_geometry_materials(input%geometry, size(blocks), size(joints), messages)
      else if (input%has_blocks) then
         call check_block_materials(input%blocks, size(blocks), size(joints), input%model_file, messages)
      end if
   end subroutine check_materials

   !> What the next attempt would report of a labelled file with errors: materials, laws of joints, end of the run.
   subroutine check_laws(input, messages)
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(parameters_type) :: parameters
      call put_materials_together(input%analysis, input%options, parameters, messages)
      call check_joints(parameters%joint_materials, messages)
   end subroutine check_laws

end module rockdda_run_described_materials
