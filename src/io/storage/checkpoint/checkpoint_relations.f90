! SPDX-License-Identifier: MIT
!> Check numbers of a run that were loaded from a checkpoint against each other.
module rockdda_io_checkpoint_relations
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : largest_coordinate
   use rockdda_model_bolt_numbers, only : bolt_problem
   use rockdda_model_parameters, only : parameters_type
   use rockdda_io_archive, only : archive_type
   implicit none
   private
   public :: check_relations

contains

   !> Check what the bounds of the table of options do not say: numbers that have been computed or depend on each other,
   !> and what a run has always.
   subroutine check_relations(archive, p)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(in) :: p
      integer :: i
      call archive%demand(p%dt_max > 0 .and. p%dt_min > 0 .and. p%dt_min <= p%dt_max, 'dt_min')
      call archive%demand(p%displacement_ratio > 0, 'displacement_ratio')
      call archive%demand(p%w0 > 0 .and. p%w0 <= largest_coordinate, 'w0')
      call archive%demand(p%normal_stiffness > 0, 'stiffness')
      call archive%demand(p%shear_stiffness > 0, 'shear_stiffness')
      call archive%demand(p%stiffness_length >= 0, 'stiffness_length')
      call archive%demand(p%fixed_stiffness > 0, 'fixed_stiffness')
      call archive%demand(p%search_distance >= 0, 'search_distance')
      call archive%demand(p%angle_tolerance >= 0 .and. p%angle_tolerance < 1.6_wp, 'angle_tolerance')
      call archive%demand(p%close_tolerance >= 0 .and. p%close_tolerance <= p%w0, 'close_tolerance')
      call archive%demand(p%open_tolerance >= 0 .and. p%open_tolerance <= p%w0, 'open_tolerance')
      if (.not. allocated(p%title)) call archive%refuse('title', 'is missing')
      if (.not. allocated(p%solver_method)) call archive%refuse('method', 'is missing')
      if (.not. allocated(p%preconditioner)) call archive%refuse('preconditioner', 'is missing')
      call archive%demand(size(p%joint_materials) > 0, 'joint_materials')
      do i = 1, size(p%joint_materials)
         if (.not. allocated(p%joint_materials(i)%law)) &
            call archive%refuse('joint_material_'//to_string(i)//'_law', 'is missing')
      end do
      do i = 1, size(p%bolts)
         call archive%demand(len(bolt_problem(p%bolts(i))) == 0, 'bolt_'//to_string(i))
      end do
      do i = 1, size(p%quakes)
         call archive%demand(allocated(p%quakes(i)%direction) .and. allocated(p%quakes(i)%apply) .and. &
                             size(p%quakes(i)%rows) > 0, 'quake_'//to_string(i)//'_record')
      end do
   end subroutine check_relations

end module rockdda_io_checkpoint_relations
