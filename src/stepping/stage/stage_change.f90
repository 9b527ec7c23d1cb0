! SPDX-License-Identifier: MIT
!> From one stage to the next: what a stage builds and takes out when it begins, the materials that change (&change),
!> and the energies that go with it.
module rockdda_stepping_stage_change
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_error, only : error_type
   use rockdda_model_options, only : is_set, change_type
   use rockdda_model_state, only : energy, block_state_type
   use rockdda_model_analysis_input, only : block_material_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_joint_options, only : change_joint
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : same_name, material_number
   use rockdda_model_stage_options, only : stage_name, is_given
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_joint_strength, only : new_joint_laws, act_along_length
   use rockdda_stepping_construction, only : construction_type
   use rockdda_stepping_stage_equilibrium, only : report_no_equilibrium
   use rockdda_stepping_motion, only : reset_measured, block_energies
   use rockdda_stepping_step, only : step_type
   implicit none
   private
   public :: change_stage

contains

   !> Leave stages that have ended, and begin the next. An error when the present one, with all its steps, has not come
   !> to equilibrium.
   subroutine change_stage(step, construction, forces, unbalanced, balance, error)
      type(step_type), intent(inout) :: step
      type(construction_type), intent(inout) :: construction
      type(block_forces_type), intent(inout) :: forces     !! of the last accepted step of this process
      real(wp), intent(in) :: unbalanced                   !! at its end
      class(energy_balance_type), intent(inout) :: balance
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: stiffest
      call step%control%end_stages(step%parameters, step%state%step, step%state%time)
      if (allocated(step%skipped)) deallocate (step%skipped)
      if (step%control%begun < step%control%stage - 1) step%skipped = step%control%skipped(step%parameters)
      if (step%control%has_failed(step%parameters, step%state%step)) then
         if (.not. allocated(forces%magnitude)) call forces%clear(step%blocks%n_blocks)
         stiffest = maxval([0.0_wp, step%contacts%k_n(1:step%contacts%n)])
         call report_no_equilibrium(step%parameters, step%control%stage, step%control%steps, step%state, forces, &
                                    unbalanced, stiffest, error)
         return
      end if
      call begin_stages(step, construction, balance)
      if (step%control%is_dynamic(step%parameters)) &
         call step%families%boundaries%become_quiet(step%step_context_type, step%trial%attempt_type, balance)
   end subroutine change_stage

   !> Blocks that are there and may have contacts: segments of linings have none.
   pure function with_contacts(step) result(seen)
      type(step_type), intent(in) :: step
      logical :: seen(step%blocks%n_blocks)
      seen = step%state%active
      seen(step%blocks%n_blocks - step%blocks%n_segments + 1:) = .false.
   end function with_contacts

   !> Carry out the start of all stages that have begun since the last step.
   subroutine begin_stages(step, construction, balance)
      type(step_type), intent(inout) :: step
      type(construction_type), intent(inout) :: construction
      class(energy_balance_type), intent(inout) :: balance
      logical :: places
      integer :: s
      places = any(construction%placed > 0)
      if (allocated(construction%overlaps)) deallocate (construction%overlaps)
      if (step%state%step == 0 .and. step%control%begun == 0) call find_first_forces()
      do s = step%control%begun + 1, min(step%control%stage, size(step%parameters%stages))
         call construction%place(s, step%blocks, step%parameters, step%state, balance)
         call bring_back()
         call take_out_blocks()
         call step%families%bars%begin_stage(s, step%step_context_type, balance)
         call step%families%liners%begin_stage(s, step%step_context_type, balance)
         if (any(construction%excavated(:, s) > 0) .or. is_set(step%parameters%stages(s)%relax)) &
            call step%control%begin_release(step%parameters)
         call take_new_materials()
         if (step%parameters%stages(s)%reset_displacement) call reset_measured(step%blocks, step%state)
         step%control%begun = s
         ! what acts on blocks asleep changes
         step%state%asleep = .false.
         step%state%calm = 0
         step%state%accelerates = .false.
      end do
      call step%trial%finder%show_blocks(with_contacts(step), construction%newborn, places)

   contains

      !> Take out the blocks of a stage, and begin to release the forces that they gave.
      subroutine take_out_blocks()
         real(wp) :: energies(step%blocks%n_blocks), share
         integer :: first
         energies = block_energies(step%blocks, step%families%elasticity, step%state)
         associate (stage => step%parameters%stages(s), held => step%families%held)
            if (step%state%step == 0) then
               call construction%excavate(s, step%blocks, step%families%contacts%table, energies, step%state, held, &
                                          balance, first)
            else
               call construction%excavate(s, step%blocks, step%contacts, energies, step%state, held, balance, first)
            end if
            share = 1
            if (is_set(stage%relax)) share = stage%relax
            ! a share that is given holds for all forces, otherwise for those of this excavation
            if (is_set(stage%relax)) first = 1
            call held%relax(first, share, stage%relax_steps)
         end associate
      end subroutine take_out_blocks

      !> Take the materials that change with a stage; what strain and motion lose by it is discarded.
      subroutine take_new_materials()
         type(diagnostics_type) :: ignored
         real(wp) :: before(step%blocks%n_blocks)
         logical :: is_new
         before = block_energies(step%blocks, step%families%elasticity, step%state)
         call change_materials(construction%changed, s, step%blocks, step%parameters, step%state, is_new)
         if (.not. is_new) return
         call new_joint_laws(step%parameters%joint_materials, step%families%contacts%laws, ignored)
         if (step%parameters%by_length) &
            call act_along_length(step%parameters%joint_materials, step%families%contacts%laws)
         call step%families%elasticity%init(step%parameters)
         call balance%add(energy%discarded, sum(before) - &
                          sum(block_energies(step%blocks, step%families%elasticity, step%state)))
         step%families%contacts%stiffness_is_new = .true.
      end subroutine take_new_materials

      !> Where the first stage excavates: contacts of all blocks with the forces that the initial stress gives them.
      subroutine find_first_forces()
         real(wp) :: reach
         if (size(construction%excavated, 2) == 0) return
         if (.not. any(construction%excavated(:, 1) > 0)) return
         step%trial%asleep = step%state%asleep
         step%trial%released = step%control%released
         step%trial%gravity = step%control%gravity(step%parameters)
         step%trial%water = step%control%water(step%parameters)
         step%trial%dt = step%control%step_size(step%parameters, step%state%time)
         call step%trial%finder%show_blocks(with_contacts(step), construction%newborn, places)
         step%trial%finder%needs_forces = .true.
         reach = step%trial%finder%first_reach(step%step_context_type, step%control, step%trial%dt)
         call step%trial%find_contacts(step%step_context_type, step%contacts, reach, step%families, step%equations, &
                                       step%solver, step%times)
         step%trial%finder%needs_forces = .false.
      end subroutine find_first_forces

      !> Blocks that were taken out and that a stage has placed again: their boundaries and line loads begin anew.
      subroutine bring_back()
         logical :: back(step%blocks%n_blocks)
         integer :: i, l
         do i = 1, size(back)
            back(i) = construction%newborn(i)
            if (back(i)) back(i) = construction%comes_back(i, s)
         end do
         if (.not. any(back)) return
         call step%families%boundaries%springs%release(.not. back)
         do l = 1, size(step%families%loads%line_blocks)
            if (.not. back(step%families%loads%line_blocks(l))) cycle
            step%line_ends(:, l) = step%parameters%line_loads(l)%ends - [step%state%datum, step%state%datum]
         end do
      end subroutine bring_back

   end subroutine begin_stages

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
            if (is_set(change%unit_weight)) call write_out_weights()
            if (is_given(change%joint_material)) then
               j = joint_of(change%joint_material, parameters)
               if (j > 0) call change_joint(change%joint, parameters%joint_materials(j))
            else if (is_given(change%region)) then
               call change_region(change, changed(:, i) > 0)
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

   contains

      !> The blocks of a region have another material, or new values: a material of their own for each that they have.
      subroutine change_region(change, inside)
         type(change_type), intent(in) :: change
         logical, intent(in) :: inside(:)          !! (nb)
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

      !> Give the materials the weights that the gravity of the run makes of their densities, so that one can have
      !> another.
      subroutine write_out_weights()
         if (parameters%gravity < 0) return
         parameters%block_materials%weight = parameters%gravity*parameters%block_materials%density
         parameters%gravity = -1
      end subroutine write_out_weights

   end subroutine change_materials

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

   !> Values that a change names.
   pure subroutine change_block_material(change, material)
      type(change_type), intent(in) :: change
      type(block_material_type), intent(inout) :: material
      if (is_set(change%density)) material%density = change%density
      if (is_set(change%young)) material%youngs_modulus = change%young
      if (is_set(change%poisson)) material%poisson_ratio = change%poisson
      if (is_set(change%unit_weight)) material%weight = change%unit_weight
   end subroutine change_block_material

end module rockdda_stepping_stage_change
