! SPDX-License-Identifier: MIT
!> Materials that groups of options call by number or name.
module rockdda_check_material_names
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity, at_word
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_analysis_input, only : named_material_type, joint_material_type
   use rockdda_model_material_names, only : number_of_material
   use rockdda_model_options, only : is_set
   use rockdda_base_suggest, only : did_you_mean
   implicit none
   private
   public :: no_material, unknown_number, check_joint_material, stiffens

contains

   !> "there is no block material 'x', did you mean ..."
   function no_material(kind, word, materials) result(text)
      character(len=*), intent(in) :: kind                    !! 'block', 'joint'
      character(len=*), intent(in) :: word
      class(named_material_type), intent(in) :: materials(:)  !! groups of the options that may name materials
      character(len=:), allocatable :: text
      character(len=80) :: known(size(materials))
      integer :: i
      known = ''
      do i = 1, size(materials)
         if (allocated(materials(i)%name)) known(i) = adjustl(materials(i)%name)
      end do
      text = 'there is no '//kind//" material '"//word//"'"//did_you_mean(word, known)
   end function no_material

   !> "block material 3 is unknown, there are 2 block materials".
   pure function unknown_number(kind, number, n) result(text)
      character(len=*), intent(in) :: kind                    !! 'block', 'joint'
      integer, intent(in) :: number                           !! that is asked for
      integer, intent(in) :: n                                !! materials of this kind
      character(len=:), allocatable :: text
      text = kind//' material '//to_string(number)//' is unknown, there '//trim(merge('is ', 'are', n == 1))//' '// &
             counted(n, kind//' material')
   end function unknown_number

   !> Check that a word is a number or name of a joint material.
   subroutine check_joint_material(group, word, n_joints, materials, origin, messages)
      character(len=*), intent(in) :: group                   !! of the options
      character(len=*), intent(in) :: word                    !! number or name
      integer, intent(in) :: n_joints                         !! joint materials
      type(joint_material_type), intent(in) :: materials(:)   !! groups of the options that may name joint materials
      type(origin_type), intent(in) :: origin
      type(diagnostics_type), intent(inout) :: messages
      integer :: joint
      joint = number_of_material(word, materials)
      if (joint < 1) then
         call messages%add(severity%error, group//': '//no_material('joint', trim(adjustl(word)), materials), &
                           at_word(origin, word))
      else if (joint > n_joints) then
         call messages%add(severity%error, group//': '//unknown_number('joint', joint, n_joints), at_word(origin, word))
      end if
   end subroutine check_joint_material

   !> Does the normal stiffness of a joint material grow with its closure?
   pure logical function stiffens(word, materials)
      character(len=*), intent(in) :: word                    !! number or name
      type(joint_material_type), intent(in) :: materials(:)   !! groups of the options that may name joint materials
      integer :: i, joint
      joint = number_of_material(word, materials)
      stiffens = .false.
      do i = 1, size(materials)
         if (materials(i)%number == joint) stiffens = stiffens .or. is_set(materials(i)%maximum_closure)
      end do
   end function stiffens

end module rockdda_check_material_names
