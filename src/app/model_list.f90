! SPDX-License-Identifier: MIT
!> The kinds of models that `rockdda new` writes, as texts.
module rockdda_app_model_list
   use rockdda_app_command_options, only : model_kinds
   use rockdda_app_new_model_files, only : model_line
   implicit none
   private
   public :: kinds_text, list_of_models

   character(len=1), parameter :: nl = new_line('a')

contains

   !> A line for each kind of model.
   pure function list_of_models() result(text)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(model_kinds)
         if (i > 1) text = text//nl
         text = text//'  '//model_kinds(i)//'  '//model_line(model_kinds(i))
      end do
   end function list_of_models

   !> The kinds of models with commas between them.
   pure function kinds_text() result(text)
      character(len=:), allocatable :: text
      integer :: i
      text = trim(model_kinds(1))
      do i = 2, size(model_kinds)
         text = text//', '//trim(model_kinds(i))
      end do
   end function kinds_text

end module rockdda_app_model_list
