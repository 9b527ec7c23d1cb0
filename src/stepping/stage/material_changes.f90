! SPDX-License-Identifier: MIT
!> Materials that change when a stage begins: `&change`.
module rockdda_stepping_material_changes
   use rockdda_base_kinds, only : wp
   use rockdda_model_analysis_input, only : block_material_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_joint_options, only : change_joint
   use rockdda_model_options, only : change_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : same_name, material_number
   use rockdda_model_stage_options, only : stage_name, is_given
   use rockdda_model_state, only : block_state_type
   implicit none
   private
   public :: change_materials

contains

   !> The changes of materials that begin with a stage.
   subroutine change_materials(changed, stage, blocks, parameters, state, is_new)
      integer, intent(in) :: changed(:, :)      !! (nb, changes) 1: the block belongs to the regions of the change
      integer, intent(in) :: stage
      type(block_system_type), intent(inout) :: blocks
      type(parameters_type), intent(inout) :: parameters
      type(block_state_type), intent(inout) :: state
      logical, intent(out) :: is_new            !! something has changed
      real(wp) :: density(blocks%n_blocks)
      integer :: i, j, m
      is_new = .false.
      if (.not. allocated(parameters%changes)) return
      density = parameters%block_materials(blocks%block_material(1:blocks%n_blocks))%density
      do i = 1, size(parameters%changes)
         associate (change => parameters%changes(i))
            if (.not. is_given(change%stage)) cycle
            if (.not. same_name(change%stage, stage_name(parameters%stages, stage))) cycle
            if (is_given(change%liner)) cycle   ! rockdda_interaction_liners
            is_new = .true.
            if (is_set(change%unit_weight)) call write_out_weights(parameters)
            if (is_given(change%joint_material)) then
               j = joint_of(change%joint_material, parameters)
               if (j > 0) call change_joint(change%joint, parameters%joint_materials(j))
            else if (is_given(change%region)) then
               call change_region(change, changed(:, i) > 0, blocks, parameters)
            else
               m = material_number(trim(adjustl(change%block_material)))
               if (m >= 1 .and. m <= size(parameters%block_materials)) &
                  call change_block_material(change, parameters%block_materials(m))
            end if
         end associate
      end do
      if (.not. is_new) return
      do i = 1, blocks%n_blocks
         associate (now => parameters%block_materials(blocks%block_material(i))%density)
            if (abs(now - density(i)) > 0) state%mass(i) = state%mass(i)*(now/density(i))
         end associate
      end do
   end subroutine change_materials

   !> Give the materials the weights that the gravity of the run makes of their densities, so that one can have another.
   pure subroutine write_out_weights(parameters)
      type(parameters_type), intent(inout) :: parameters
      if (parameters%gravity < 0) return
      parameters%block_materials%weight = parameters%gravity*parameters%block_materials%density
      parameters%gravity = -1
   end subroutine write_out_weights

   !> Number of the joint material with a number or name, 0: none.
   pure integer function joint_of(word, parameters) result(j)
      character(len=*), intent(in) :: word
      type(parameters_type), intent(in) :: parameters
      integer :: i
      j = material_number(trim(adjustl(word)))
      if (j > size(parameters%joint_materials)) j = 0
      if (j > 0) return
      do i = 1, size(parameters%joint_materials)
         if (.not. is_given(parameters%joint_materials(i)%name)) cycle
         if (same_name(parameters%joint_materials(i)%name, word)) j = i
      end do
   end function joint_of

   !> The blocks of a region have another material, or new values: a material of their own for each that they have.
   subroutine change_region(change, inside, blocks, parameters)
      type(change_type), intent(in) :: change
      logical, intent(in) :: inside(:)          !! (nb)
      type(block_system_type), intent(inout) :: blocks
      type(parameters_type), intent(inout) :: parameters
      type(block_material_type) :: own
      integer :: m, n
      n = size(parameters%block_materials)
      if (is_given(change%block_material)) then
         m = material_number(trim(adjustl(change%block_material)))
         if (m >= 1 .and. m <= n) then
            where (inside) blocks%block_material = m
         end if
      end if
      if (.not. any([is_set(change%density), is_set(change%young), is_set(change%poisson), &
                     is_set(change%unit_weight)])) return
      do m = 1, n
         if (.not. any(inside .and. blocks%block_material(1:size(inside)) == m)) cycle
         own = parameters%block_materials(m)
         call change_block_material(change, own)
         parameters%block_materials = [parameters%block_materials, own]
         where (inside .and. blocks%block_material(1:size(inside)) == m) &
            blocks%block_material(1:size(inside)) = size(parameters%block_materials)
      end do
   end subroutine change_region

   !> Values that a change names.
   pure subroutine change_block_material(change, material)
      type(change_type), intent(in) :: change
      type(block_material_type), intent(inout) :: material
      if (is_set(change%density)) material%density = change%density
      if (is_set(change%young)) material%youngs_modulus = change%young
      if (is_set(change%poisson)) material%poisson_ratio = change%poisson
      if (is_set(change%unit_weight)) material%weight = change%unit_weight
   end subroutine change_block_material

end module rockdda_stepping_material_changes
